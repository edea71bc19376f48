#pragma once
// The albedo of surfaces that camera paths hit, for AOVs.
#include "worker/render/pipeline/paths/vertex_io.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// Share of light that a vertex reflects or transmits towards its viewer, RGB, by sampling: the same fixed
/// points everywhere, of which the first two dimensions are stratified and the lobe follows the golden ratio.
/// `diffuse`, if given, gets the part that diffuse lobes have of it (diffuse_share.h).
Vec3<Lane> albedo_at(const RenderScene& scene, const VertexLanes<Lane>& v, LaneMask active,
                     Vec3<Lane>* diffuse);

}  // namespace lightmill
