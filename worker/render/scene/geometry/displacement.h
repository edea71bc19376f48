#pragma once
// Displacement: meshes whose vertices a texture moves along their normals before the scene is built.
#include <optional>
#include <vector>

#include "common/scene/description.h"
#include "worker/render/scene/textures/texture.h"

namespace lightmill {

/// Triangles of one mesh that refinement stops at.
inline constexpr size_t kMostDisplacedTriangles = size_t{1} << 24;

/// `description` with its displaced meshes in place of those that say "displacement"; none if there are no
/// such. A mesh is first split until no edge is longer than its edge_length (scene units; 0: it is not). Then
/// each vertex moves along its normal by the texture's height, in the mesh's own space. Vertices at one place
/// stay together: they move by the mean of what each would. Normals are made anew; flat meshes stay flat.
/// Warns where the splitting ends too soon.
std::optional<SceneDescription> with_displaced_meshes(const SceneDescription& description,
                                                      const TextureTable& textures, int threads,
                                                      std::vector<Problem>* warnings,
                                                      size_t most_triangles = kMostDisplacedTriangles);

}  // namespace lightmill
