#include "worker/render/pipeline/producer.h"

#include <algorithm>

#include "worker/render/light/light_sampling.h"
#include "worker/render/math/ray_offset.h"
#include "worker/render/pipeline/connections/volume_light_sampling.h"
#include "worker/render/pipeline/context.h"
#include "worker/render/pipeline/kernel_choice.h"
#include "worker/render/pipeline/paths/path_io.h"
#include "worker/render/pipeline/paths/path_kinds.h"
#include "worker/render/pipeline/paths/path_radiance.h"
#include "worker/render/pipeline/paths/path_times.h"
#include "worker/render/pipeline/recording/strategy_recorder.h"
#include "worker/render/pipeline/shadow_caster.h"
#include "worker/render/scene/lights/emitter_pattern.h"

namespace lightmill {
namespace {

/// Slots base .. base + kLanes - 1: which of them have a path, and their pixels.
struct SlotGroup {
  LaneInt slot, x, y;
  LaneMask taken;
  SlotGroup(const LayerContext& layer, int base) {
    slot = lane_index<Lane>() + base;
    const LaneInt pixel = load_int<Lane>(layer.slots->pixel + base);
    x = gather(layer.slots->x, pixel);
    y = gather(layer.slots->y, pixel);
    taken = LaneMask(load_int<Lane>(layer.slots->taken + base) > 0);
  }
};

void activate(Paths& paths, LaneInt slot, LaneMask mask) {
  for (unsigned bits = mask_bits(mask); bits; bits &= bits - 1) {
    paths.active[paths.active_count++] = lane(slot, std::countr_zero(bits));
  }
}

template <class C>
void camera_paths(const C& camera, const StageContext& context, const LayerContext& layer,
                  Wavefront& wavefront) {
  Paths& paths = wavefront.paths;
  paths.active_count = 0;
  const bool signed_filter = context.filter.is_signed();
  for (int base = 0; base < kWavefront; base += kLanes) {
    const SlotGroup g(layer, base);
    if (!any(g.taken)) continue;
    Lane u, v;
    const SampleStream<Lane> stream = layer.camera_stream<Lane>(g.slot);
    stream.get_2d(kDimFilm, &u, &v);
    const Lane x = to_float(g.x) + 0.5f + context.filter.x.sample(u);
    const Lane y = to_float(g.y) + 0.5f + context.filter.y.sample(v);
    if (signed_filter) {
      float* weight = wavefront.slots.weight + base;
      store(weight, load<Lane>(weight) * context.filter.x.weight(u) * context.filter.y.weight(v));
    }
    Lane lu{}, lv{};
    if constexpr (C::kHasLens) stream.get_2d(kDimLens, &lu, &lv);
    CameraRay<Lane> ray = camera.ray(x, y, lu, lv);
    if (context.scene.moves()) {
      const Lane time = times_of_paths(context, layer, stream);
      store(paths.time + base, time);
      const CameraMotion& motion = context.scene.camera_motion;
      if (motion.moves) {
        ray.origin = motion.point(ray.origin, time);
        ray.direction = motion.vector(ray.direction, time);
      }
    }
    PathLanes<Lane> path{ray.origin, ray.direction, splat3<Lane>(1, 1, 1)};
    LaneMask started = g.taken;
    if constexpr (C::kWeighted) {
      path.throughput = {ray.weight, ray.weight, ray.weight};
      started = mask_and(started, LaneMask(ray.weight > 0.0f));
    }
    path.dvcm = splat<Lane>(context.light_samples) / ray.density;  // M2
    path.medium = splat_int<Lane>(context.scene.camera_medium);
    store_paths(path, g.slot, mask_bits(started), &paths);
    if (context.scene.tracks_ray_kinds()) std::fill_n(paths.kinds + base, kLanes, kCameraRays);
    activate(paths, g.slot, started);
    wavefront.counters.camera_paths += static_cast<uint64_t>(std::popcount(mask_bits(g.taken)));
  }
}

template <class K>
void light_paths(const StageContext& context, const LayerContext& layer, Wavefront& wavefront) {
  Paths& paths = wavefront.paths;
  paths.active_count = 0;
  const LightTable& lights = context.lights;
  const int count = std::min(layer.light_paths - layer.first_light_path, kWavefront);
  wavefront.counters.light_paths += static_cast<uint64_t>(count);
  if (lights.count() == 0) return;
  for (int base = 0; base < count; base += kLanes) {
    const LaneInt slot = lane_index<Lane>() + base;
    const LaneMask started = LaneMask(slot < count);
    const SampleStream<Lane> stream = layer.light_stream<Lane>(slot);
    if (context.scene.moves()) store(paths.time + base, times_of_paths(context, layer, stream));
    Lane pu, pv, du, dv;
    stream.get_2d(kDimLightPosition, &pu, &pv);
    stream.get_2d(kDimLightDirection, &du, &dv);
    const Lane texel = K::kLights && lights.any_texels() ? stream.get_1d(kDimLightTexel) : Lane{};
    EmissionSample<Lane> e = sample_emission<Lane, K::kLights>(
        lights, stream.get_1d(kDimLightSelect), texel, pu, pv, du, dv, light_times<K>(lights, paths, slot));
    if (K::kLights && !lights.patterns.empty()) apply_pattern(context.scene, started, &e);
    LaneMask seen = started;
    const LaneMask shines = seen_lights(lights, e.light, started, [](int) { return kScatteredRays; });
    if (!lights.hidden.empty()) e.power = select(shines, e.power, Vec3<Lane>{});
    if (K::kMedia && !lights.volumes.empty()) {
      sample_volume_emission(context, stream, pu, pv, du, dv,
                             context.scene.any_moving() ? paths.time + base : nullptr, started, &e);
      seen = mask_and(started, mask_not(volume_lanes(lights, e.light, started)));
    }
    if (context.on(kLightTracing)) queue_emitter_to_lens(context, layer, slot, seen, e, wavefront);
    PathLanes<Lane> path{offset_origin(e.point, e.error, e.normal, e.direction), e.direction, e.power};
    path.dvcm = 1.0f / e.pdf;  // M1; p_direct follows at the first hit, which it may depend on
    if (context.on(kEmissionHits)) path.dvc = select(e.delta, Lane{}, e.cos_light * path.dvcm);
    if (StrategyRecorder* recorder = recorder_of<K>(wavefront))
      recorder->start_light_paths(base, path.dvc, e.light, e.direction);
    if (wavefront.groups) store(wavefront.groups->of_path + base, groups_of(wavefront, lights, e.light));
    path.light = e.light;
    path.cos_light = e.cos_light;
    if (K::kMedia && !lights.media.empty()) {
      const LaneInt sides = gather(lights.media.data(), e.light);
      path.medium = medium_on_side<Lane>(sides, LaneMask(dot(e.normal, e.direction) > 0.0f));
    }
    store_paths(path, slot, mask_bits(started), &paths);
    activate(paths, slot, mask_and(started, LaneMask(max_component(e.power) > 0.0f)));
  }
}

}  // namespace

void produce_camera_paths(const StageContext& context, const LayerContext& layer, Wavefront& wavefront) {
  if (wavefront.recorder) wavefront.recorder->start_camera_paths();
  std::visit([&](const auto& camera) { camera_paths(camera, context, layer, wavefront); }, context.camera);
}

void produce_light_paths(const StageContext& context, const LayerContext& layer, Wavefront& wavefront) {
  with_kernels(context.kernels.paths, wavefront,
               [&]<class K>(K) { light_paths<K>(context, layer, wavefront); });
}

}  // namespace lightmill
