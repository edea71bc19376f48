#include "worker/render/pipeline/pipeline.h"

#include <algorithm>
#include <optional>
#include <span>

#include "common/job/light_path_count.h"
#include "worker/render/pipeline/bouncer.h"
#include "worker/render/pipeline/caster.h"
#include "worker/render/pipeline/connections/manifold_next_event.h"
#include "worker/render/pipeline/film.h"
#include "worker/render/pipeline/light_path_sampling.h"
#include "worker/render/pipeline/paths/path_times.h"
#include "worker/render/pipeline/producer.h"
#include "worker/render/pipeline/recording/aov_recorder.h"
#include "worker/render/pipeline/recording/stage_probe.h"
#include "worker/render/pipeline/recording/strategy_recorder.h"
#include "worker/render/pipeline/recording/thread_time.h"
#include "worker/render/pipeline/shadow_caster.h"

namespace lightmill {
namespace {

/// Splats kept before they are handed to the tile.
constexpr size_t kSplatBatch = 1 << 15;

/// Runs a stage. A recorder that wants its time gets it in `member` or, if null, divided among the
/// strategies.
template <class Stage>
void run(Wavefront& w, double StrategyRecorder::*member, Stage&& stage) {
  if (!w.recorder || !w.recorder->timed) return stage();
  const double start = thread_cpu_seconds();
  if (!member) w.recorder->begin_stage();
  stage();
  const double seconds = thread_cpu_seconds() - start;
  if (member) {
    w.recorder->*member += seconds;
  } else {
    w.recorder->end_stage(seconds);
  }
}

template <class Form>
void connect(Wavefront& w, Form&& form) {
  run(w, nullptr, [&] {
    const StageScope scope(w, Stage::kConnect);
    form();
  });
}

/// Light paths of a layer: about as many as are asked for, per pixel of the cell that is rendered.
int light_paths_of(const StageContext& context, const CameraSlots& slots) {
  return light_paths_of_layer(context.light_paths, slots.inside_count);
}

/// One wavefront of light paths; their vertices are added to the cache.
void light_pass(const StageContext& context, const LayerContext& layer, Wavefront& w) {
  const bool direct = w.aovs && w.aovs->wants_direct() && context.on(kLightTracing);
  const size_t first_splat = w.splats.size();
  std::optional<size_t> direct_end;
  run(w, &StrategyRecorder::light_subpath_seconds, [&] {
    const StageScope scope(w, Stage::kProduce);
    produce_light_paths(context, layer, w);
  });
  for (int depth = 1; w.paths.active_count > 0 && depth <= context.max_depth; ++depth) {
    if (!context.on(kVertexConnections)) w.light_vertices.clear();
    const size_t first = w.light_vertices.size();
    run(w, &StrategyRecorder::light_subpath_seconds, [&] {
      cast_light_paths(context, layer, depth, w);
      const StageScope scope(w, Stage::kBounce);
      bounce_light_paths(context, layer, depth, w);
    });
    if (context.on(kLightTracing)) connect(w, [&] { shadow_light_tracing(context, layer, depth, first, w); });
    if (direct && depth == 1) {
      flush_shadow_rays(context, true, w);
      direct_end = w.splats.size();
    }
  }
  flush_shadow_rays(context, true, w);
  if (direct) {
    const size_t end = direct_end.value_or(w.splats.size());
    w.aovs->direct_splats(std::span(w.splats).subspan(first_splat, end - first_splat));
  }
}

void trace_camera_paths(const StageContext& context, const LayerContext& layer, Wavefront& w) {
  run(w, &StrategyRecorder::camera_subpath_seconds, [&] {
    const StageScope scope(w, Stage::kProduce);
    produce_camera_paths(context, layer, w);
  });
  begin_manifolds(context, w);
  for (int depth = 1; w.paths.active_count > 0; ++depth) {
    run(w, &StrategyRecorder::camera_subpath_seconds, [&] {
      cast_camera_paths(context, layer, depth, w);
      const StageScope scope(w, Stage::kBounce);
      bounce_camera_paths(context, layer, depth, w);
    });
    if (w.aovs) {
      if (depth == 2) w.aovs->end_direct(w);
      if (!context.on(kCameraLayer) && w.aovs->first_hits_done(w.paths)) return;
    }
    if (context.on(kNextEvent)) connect(w, [&] { shadow_next_event(context, layer, depth, w); });
    if (w.aovs && depth == 1) {
      flush_shadow_rays(context, false, w);
      w.aovs->direct_so_far(w);
    }
    if (context.on(kVertexConnections)) connect(w, [&] { shadow_connections(context, layer, depth, w); });
    flush_shadow_rays(context, false, w);
    if (w.aovs && depth == 1) w.aovs->begin_indirect(w);
    if (!context.scene.manifolds.empty() && context.on(kCameraLayer)) {
      run(w, &StrategyRecorder::camera_subpath_seconds, [&] {
        const StageScope scope(w, Stage::kConnect);
        connect_manifolds(context, layer, depth, w);
      });
    }
  }
}

/// One wavefront of camera paths: those of the slots.
void camera_pass(const StageContext& context, const LayerContext& layer, int quantum_exponent, Wavefront& w) {
  std::fill(std::begin(w.radiance_r), std::end(w.radiance_r), 0.0f);
  std::fill(std::begin(w.radiance_g), std::end(w.radiance_g), 0.0f);
  std::fill(std::begin(w.radiance_b), std::end(w.radiance_b), 0.0f);
  if (w.aovs) w.aovs->begin_layer(w);
  trace_camera_paths(context, layer, w);
  const StageScope scope(w, Stage::kFilm);
  film_finish_pass(context, quantum_exponent, w);
  if (w.aovs) w.aovs->finish_layer(context, quantum_exponent, w);
}

void hand_over_splats(Wavefront& w, PartialBuilder* builder) {
  if (w.splats.empty()) return;
  if (builder && w.groups) w.aovs->groups().add_splats(w.splats, *builder);
  if (builder && !w.groups) builder->add_splats(w.splats);
  if (!builder && w.groups) w.aovs->groups().forget_splats();
  if (builder && w.lobes) w.aovs->lobes().add_splats(w.splats, *builder);
  if (!builder && w.lobes) w.aovs->lobes().forget_splats();
  w.splats.clear();
}

}  // namespace

void render_packet(const StageContext& context, const Packet& packet, int quantum_exponent, Wavefront& w,
                   PartialBuilder* builder) {
  const double start = thread_cpu_seconds();
  w.counters = {};
  w.dropped = w.dropped_light = {};
  prepare(context, &w);
  w.splats.clear();
  const int64_t superblock = superblock_of_sample(packet.sample_begin);
  LayerContext layer;
  layer.slots = &w.slots;
  w.slots.begin_superblock(context, packet.cell_x, packet.cell_y, superblock, context.pixel_subset);
  layer.light_paths = light_paths_of(context, w.slots);
  set_light_path_sampling(context, packet.cell_x, packet.cell_y, superblock, &layer);
  const bool light_paths = context.on(kLightPaths), camera_layer = context.on(kCameraLayer) || w.aovs;
  if (w.aovs) w.aovs->begin_packet();
  if (camera_layer) w.camera_sums.assign(kCellPixels, {});
  for (int64_t s = packet.sample_begin; s < packet.sample_end; ++s) {
    layer.sample_in_superblock = static_cast<uint32_t>(s - superblock * kSuperblockSamples);
    if (w.recorder) w.recorder->begin_layer(w.slots, context.grid.width);
    layer.time = time_of_layer(context, layer);
    w.light_vertices.clear();
    for (layer.first_light_path = 0; light_paths && layer.first_light_path < layer.light_paths;
         layer.first_light_path += kWavefront) {
      light_pass(context, layer, w);
    }
    if (camera_layer && w.slots.is_even(s)) {
      w.slots.begin_even_pass(s);
      camera_pass(context, layer, quantum_exponent, w);
    } else if (camera_layer) {
      w.slots.add_waiting(s);
      // Light vertices to connect to belong to one index, and so does their time.
      const bool rest = s + 1 == packet.sample_end || context.on(kVertexConnections);
      while (w.slots.begin_waiting_pass(rest)) camera_pass(context, layer, quantum_exponent, w);
    }
    if (w.splats.size() >= kSplatBatch) hand_over_splats(w, builder);
  }
  if (!builder) return;
  hand_over_splats(w, builder);
  if (camera_layer)
    builder->add_camera(packet.cell_x, packet.cell_y, std::span<const ExactRgb, kCellPixels>(w.camera_sums));
  if (w.aovs) w.aovs->finish_packet(packet, context.scene, *builder);
  if (context.light_factor != 1) w.dropped.scale_light(double{context.light_factor});
  builder->add_dropped(w.dropped, w.dropped_light);
  builder->add_counters(w.counters, thread_cpu_seconds() - start);
}

}  // namespace lightmill
