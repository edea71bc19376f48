#pragma once
// Stage 3: groups hits by BSDF kind, reconstructs surfaces, updates the MIS quantities, keeps the vertices
// that can be connected, adds emitter hits of camera paths (s = 0), samples the BSDF and plays Russian
// roulette.
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Processes the hits of light paths at vertex `depth` (1: the first surface). Vertices that can be connected
/// are appended to the packet's light-vertex cache, wavefront.light_vertices. paths.active becomes the
/// survivors.
void bounce_light_paths(const StageContext& context, const LayerContext& layer, int depth,
                        Wavefront& wavefront);

/// The same for camera paths. Vertices that can be connected go to wavefront.vertices, which is cleared
/// first.
void bounce_camera_paths(const StageContext& context, const LayerContext& layer, int depth,
                         Wavefront& wavefront);

}  // namespace lightmill
