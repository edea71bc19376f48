#pragma once
// A mesh that bends while the shutter is open, at even times.
#include <vector>

#include "common/scene/gltf/animation/deformation.h"

namespace lightmill {

/// The mesh at as many even times as keep all vertices between them within a two-thousandth of its size of
/// where they belong: half a pixel for one of a thousand. One step if nothing moves.
std::vector<MeshStep> steps_of(const GltfDeformer& deformer, const MeshStep& rest,
                               const GltfBending& bending);
/// Of vertices that are nowhere at some time, or whose normals have no direction then, those of the first.
void mend_later(TriangleMesh* mesh);

}  // namespace lightmill
