#pragma once
// glTF cameras and KHR_lights_punctual. Both look along the -z axis of their node, with +y up.
#include "common/scene/gltf/box.h"
#include "common/scene/gltf/nodes.h"

namespace lightmill {

/// Throws GltfProblem. Intensities are candela and lux as the file says, per channel.
LightKind gltf_light(const GltfValue& light, const Transform& node_to_world);

/// Chooses the camera called `wanted` (its own name or its node's, "name.1" for the second of a name, or a
/// number from 0; empty: the first) and sets camera and resolution. Without a camera `reach`, or if that is
/// empty the scene's bounds, are framed, with a warning.
void choose_gltf_camera(GltfScene& scene, const std::vector<GltfPlacedCamera>& cameras,
                        const std::string& wanted, const GltfBox& reach);

}  // namespace lightmill
