#pragma once
// Follows camera paths for what they meet, not for an image.
#include "worker/render/pipeline/bouncer.h"
#include "worker/render/pipeline/caster.h"
#include "worker/render/pipeline/producer.h"

namespace lightmill {

/// Follows the camera paths of sample index `s` of the cell whose superblock w.slots have begun. Paths
/// without a time of their own are at time 0. visit(depth) is called when paths have come to their vertices
/// of that depth, up to `depths`, and may end some of them.
template <class Visit>
void follow_camera_paths(const StageContext& context, int64_t s, int depths, Wavefront& w, Visit&& visit) {
  LayerContext layer;
  layer.slots = &w.slots;
  layer.sample_in_superblock = static_cast<uint32_t>(s % kSuperblockSamples);
  w.slots.begin_even_pass(s);
  produce_camera_paths(context, layer, w);
  for (int depth = 1; w.paths.active_count > 0 && depth <= depths; ++depth) {
    cast_camera_paths(context, layer, depth, w);
    bounce_camera_paths(context, layer, depth, w);
    visit(depth);
  }
}

}  // namespace lightmill
