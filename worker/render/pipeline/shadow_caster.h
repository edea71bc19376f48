#pragma once
// Stage 4: forms the connections. Each contribution is evaluated first, with its MIS weight; zero ones are
// dropped, tiny ones play Russian roulette, and what is left is tested for occlusion in batches, which hand
// over to the film (stage 5). A file for each kind: next_event.cc, vertex_connections.cc,
// light_tracing.cc.
#include "worker/render/light/light_sampling.h"
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// s = 1: every vertex of wavefront.vertices samples a light (M7).
void shadow_next_event(const StageContext& context, const LayerContext& layer, int depth,
                       Wavefront& wavefront);
/// s >= 2, t >= 2: every vertex of wavefront.vertices is connected to every stored vertex of its slot's light
/// path that the depth limits allow (M9).
void shadow_connections(const StageContext& context, const LayerContext& layer, int depth,
                        Wavefront& wavefront);
/// t = 1: light vertices from index `first` on are joined to the camera (M8); splats go to the film.
void shadow_lens(const StageContext& context, const LayerContext& layer, int depth, size_t first,
                 Wavefront& wavefront);
/// s = t = 1: the emission samples themselves seen through the lens (M10).
void queue_emitter_to_lens(const StageContext& context, const LayerContext& layer, LaneInt slot,
                           LaneMask active, const EmissionSample<Lane>& emission, Wavefront& wavefront);
/// Tests what is queued and gives it to the film. `splats`: the targets are film pixels, else path slots.
void flush_shadow_rays(const StageContext& context, bool splats, Wavefront& wavefront);

}  // namespace lightmill
