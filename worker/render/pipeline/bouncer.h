#pragma once
// Stage 3: groups hits by BSDF kind, reconstructs surfaces, updates the MIS quantities, hands connectable
// vertices on, adds what camera paths see directly (s = 0), samples the BSDF and plays Russian roulette.
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Processes the hits of light paths at vertex `depth` (1 = first surface). Appends connectable
/// vertices to wavefront.light_vertices (and, if the plan connects, to the slots' lists);
/// paths.active becomes the survivors.
void bounce_light_paths(const StageContext& context, const LayerContext& layer, int depth,
                        Wavefront& wavefront);

/// The same for camera paths; connectable vertices go to wavefront.vertices, which is cleared first.
void bounce_camera_paths(const StageContext& context, const LayerContext& layer, int depth,
                         Wavefront& wavefront);

}  // namespace lightmill
