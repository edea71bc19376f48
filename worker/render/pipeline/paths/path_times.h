#pragma once
// The times of paths, in scenes where something moves.
//
// Light subpaths and camera subpaths that are joined must share their time. So with vertex connections a
// layer of a packet has one time, stratified over its sample indices and over the packets of a superblock.
// Without them each subpath has its own, stratified like the other dimensions of its stream. Next-event
// estimation and light tracing are at the time of the subpath that they end. MIS weights compare strategies
// for one path, at one time, so they do not depend on times.
// one time, so times do not show in them.
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// The value of LayerContext::time.
inline float time_of_layer(const StageContext& context, const LayerContext& layer) {
  if (!context.scene.moves()) return 0;
  const SampleStream<float> stream{layer.light_key, layer.packet_index + layer.sample_in_superblock};
  return context.scene.time_at(stream.get_1d(kDimLayerTime));
}

/// Times of subpaths that begin.
inline Lane times_of_paths(const StageContext& context, const LayerContext& layer,
                           const SampleStream<Lane>& stream) {
  if (context.on(kVertexConnections)) return splat<Lane>(layer.time);
  return context.scene.time_at(stream.get_1d(kDimTime));
}

/// Times of path slots, to ask where instances are.
inline Lane times_of_slots(const RenderScene& scene, const Paths& paths, LaneInt slot) {
  return scene.any_moving() ? gather(paths.time, slot) : Lane{};
}
/// The same, to ask where lights are.
template <class K>
inline Lane light_times(const LightTable& lights, const Paths& paths, LaneInt slot) {
  return K::kLights && lights.any_moving() ? gather(paths.time, slot) : Lane{};
}
/// The times that Accel gets; null if nothing moves.
inline const float* times_of_rays(const RenderScene& scene, const Paths& paths) {
  return scene.any_moving() ? paths.time : nullptr;
}
inline RayView view_of(const RenderScene& scene, const ShadowRays& q) {
  return {q.ox, q.oy, q.oz, q.dx, q.dy, q.dz, scene.any_moving() ? q.time : nullptr};
}

}  // namespace lightmill
