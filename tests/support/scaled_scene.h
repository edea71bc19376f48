#pragma once
// Scenes scaled by powers of two, and one to scale that has something of every kind.
#include <string>

#include "tests/support/test_scene.h"

namespace lightmill::test {

/// The scene 2^k times as large: lengths through the transforms and the camera's parameters, intensities with
/// the square, coefficients of media with the inverse. Radiance and the irradiance of distant lights stay,
/// and so does the image.
SceneDescription scaled_scene(const SceneDescription& scene, int k);
/// The same by the vertices of meshes themselves, which must stay within float.
SceneDescription scaled_vertices(const SceneDescription& scene, int k);

/// Triangles and spheres, every kind of material, and lights of every kind: area, textured sphere, point,
/// spot, distant and infinite, the last of an image if `environment` names one, and then a goniometric and a
/// projection light by it, too.
TestScene scene_of_everything(const std::string& environment = {});

}  // namespace lightmill::test
