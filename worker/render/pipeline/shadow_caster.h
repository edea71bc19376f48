#pragma once
// Stage 4: forms the connections, with a file for each kind: next_event.cc, vertex_connections.cc,
// light_tracing.cc. A contribution is evaluated first, with its MIS weight. Zero ones are dropped, tiny ones
// play Russian roulette. The rest is tested for occlusion in batches, which go on to the film (stage 5).
#include "worker/render/light/light_sampling.h"
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// s = 1: every vertex of wavefront.vertices samples a light (M7).
void shadow_next_event(const StageContext& context, const LayerContext& layer, int depth,
                       Wavefront& wavefront);
/// s >= 2, t >= 2: every vertex of wavefront.vertices is connected to vertices drawn from the packet's
/// light-vertex cache, wavefront.light_vertices: each with probability connections / light paths of the
/// layer, and left out if the joined path would be too long (M9).
void shadow_connections(const StageContext& context, const LayerContext& layer, int depth,
                        Wavefront& wavefront);
/// t = 1: cached light vertices from index `first` on are joined to the camera (M8). The splats go to the
/// film.
void shadow_light_tracing(const StageContext& context, const LayerContext& layer, int depth, size_t first,
                          Wavefront& wavefront);
/// s = t = 1: the emission samples themselves are joined to the camera (M10).
void queue_emitter_to_lens(const StageContext& context, const LayerContext& layer, LaneInt slot,
                           LaneMask active, const EmissionSample<Lane>& emission, Wavefront& wavefront);
/// Tests the queued rays for occlusion and gives the rest to the film. `splats`: the targets are film pixels,
/// else slots of paths.
void flush_shadow_rays(const StageContext& context, bool splats, Wavefront& wavefront);

}  // namespace lightmill
