// Light tracing: light vertices and emitters joined to the camera (t = 1).
#include "worker/render/math/ray_offset.h"
#include "worker/render/pipeline/connections/guided_density.h"
#include "worker/render/pipeline/connections/joined_vertices.h"
#include "worker/render/pipeline/connections/shadow_queue.h"
#include "worker/render/pipeline/connections/splat_target.h"
#include "worker/render/pipeline/paths/path_kinds.h"
#include "worker/render/pipeline/paths/path_radiance.h"
#include "worker/render/pipeline/paths/path_times.h"
#include "worker/render/pipeline/shadow_caster.h"

namespace lightmill {
namespace {

/// Joins points `p` of paths `slot` to the camera. The lens sample is dimension `dim` of `stream`, if there
/// is a lens.
LensConnection<Lane> connect_lens(const StageContext& context, const SampleStream<Lane>& stream, uint32_t dim,
                                  const Vec3<Lane>& p, LaneInt slot, const Wavefront& w) {
  const auto connect = [&](const Vec3<Lane>& at) {
    return std::visit(
        [&](const auto& camera) {
          Lane u{}, v{};
          if constexpr (std::decay_t<decltype(camera)>::kHasLens) stream.get_2d(dim, &u, &v);
          return camera.connect(at, u, v);
        },
        context.camera);
  };
  const CameraMotion& motion = context.scene.camera_motion;
  if (!motion.moves) return connect(p);
  const Lane time = gather(w.paths.time, slot);
  LensConnection<Lane> c = connect(motion.at_rest(p, time));
  c.lens = motion.point(c.lens, time);
  c.direction = motion.vector(c.direction, time);
  return c;
}

/// Sets the place on the film, and the random number (dimension `dim`) that small filter weights go by.
void set_raster(const StageContext& context, const LensConnection<Lane>& lens,
                const SampleStream<Lane>& stream, uint32_t dim, Candidates* c) {
  if (context.filter.is_one_pixel()) return;
  c->raster_x = lens.x;
  c->raster_y = lens.y;
  c->small_choice = stream.get_random(dim);
}

template <class K>
void light_tracing(const StageContext& context, const LayerContext& layer, int depth, size_t first,
                   Wavefront& w) {
  for (size_t base = first; base < w.light_vertices.size(); base += kLanes) {
    const VertexGroup g(w.light_vertices, base, context.scene);
    const VertexLanes<Lane>& v = g.v;
    const SampleStream<Lane> stream = layer.light_stream<Lane>(v.path);
    const LensConnection<Lane> lens =
        connect_lens(context, stream, vertex_dim(depth, kDimSplatLens), v.p, v.path, w);
    const Vec3<Lane>& to_camera = lens.direction;
    LaneMask seen = mask_and(mask_and(g.active, lens.seen), faces_viewer<K>(v, to_camera));
    if (context.scene.hides != 0) seen = mask_and(seen, LaneMask(v.unseen == 0));
    if (!any(seen)) continue;
    const SplatTarget target(context, lens.x, lens.y, seen);
    const LaneMask valid = target.valid;
    if (!any(valid)) continue;
    const Frame<Lane> frame(v.ns);
    const Vec3<Lane> to_light = frame.to_local(v.wo), wo = local_viewer(context, v, frame, to_camera);
    BsdfEval<Lane> f =
        eval_bsdf<Lane, K::kSurfaces>(v.kind, valid, v.params, to_light, wo, Mode::kImportance);
    f.pdf_reverse = camera_density(context.scene, v, f.pdf_reverse);
    const Lane p_camera = lens.density * density_cosine<K>(v, to_camera);
    const Lane light_ratio = p_camera * (1.0f / context.light_samples);
    const Lane w_light = light_ratio * (v.dvcm + v.dvc * f.pdf_reverse);  // M8
    const Lane mis = mis_weight(w_light, Lane{});
    const Lane scale =
        lens.density * adjoint_cosine<K>(v, to_camera) * mis * (context.imaging_ratio * context.splat_scale);
    Candidates c;
    if constexpr (K::kMedia) {
      c.medium = medium_towards(v, to_camera), c.ratio = w_light;
      c.seed = volume_seed(context, stream, vertex_dim(depth, kDimJoinedVolume));
    }
    c.value = select(valid, v.throughput * f.f * scale, Vec3<Lane>{});
    c.origin = offset_origin(v.p, v.error, v.ng, to_camera);
    c.direction = -(c.origin - lens.lens);
    c.tfar = splat<Lane>(kSegmentEnd);
    c.target = target.pixel;
    c.path = v.path;
    c.group = v.group;
    if (lobes_of<K>(w)) {
      const LobeLanes direct = lobes_of_event(v, valid, wo, to_light);
      c.lobes = depth == 1 ? direct : made_indirect(direct);
    }
    set_raster(context, lens, stream, vertex_dim(depth, kDimSplatSmall), &c);
    const Lane u =
        context.tiny_contribution > 0 ? stream.get_random(vertex_dim(depth, kDimNeeRoulette)) : Lane{};
    if (StrategyRecorder* recorder = recorder_of<K>(w)) {
      FamilyRatios ratios{};
      add_ratio(&ratios, &FamilyShares::lens, splat<Lane>(1.0f));
      recorder->add_stored(true, g.index, v.depth, light_ratio, v.dvcm, v.dvc, f.pdf_reverse, &ratios);
      recorder->announce(splat_int<Lane>(depth + 1), 1, v.path, v.path, mis, ratios);
    }
    queue<K>(context, c, valid, context.tiny_contribution, u, true, w);
  }
  flush_shadow_rays(context, true, w);
}

template <class K>
void emitter_to_lens(const StageContext& context, const LayerContext& layer, LaneInt slot, LaneMask active,
                     const EmissionSample<Lane>& e, Wavefront& w) {
  const LaneMask surface =
      seen_lights(context.lights, e.light, mask_and(active, mask_not(mask_or(e.delta, e.infinite))),
                  [](int) { return kCameraRays; });
  // Nor are lamps joined to the camera by themselves.
  const LaneMask joins =
      K::kLights && !context.lights.lamps.empty()
          ? mask_and(surface, LaneMask(gather(context.lights.type.data(), e.light) <= kSphereLight))
          : surface;
  if (!any(joins)) return;
  const SampleStream<Lane> stream = layer.light_stream<Lane>(slot);
  const LensConnection<Lane> lens =
      connect_lens(context, stream, vertex_dim(0, kDimSplatLens), e.point, slot, w);
  const Vec3<Lane>& to_camera = lens.direction;
  const LaneMask seen = mask_and(joins, lens.seen);
  if (!any(seen)) return;
  const SplatTarget target(context, lens.x, lens.y, seen);
  const LaneMask valid = target.valid;
  Vec3<Lane> radiance = emitted_radiance(context.lights, e.light, e.normal, to_camera);
  if (K::kLights && !context.lights.patterns.empty()) radiance = radiance * e.pattern;
  // Density of the point alone: selection / area.
  LightRecord<Lane> r(context.lights, e.light);
  if constexpr (K::kLights) r.move_to(context.lights, e.light, light_times<K>(context.lights, w.paths, slot));
  const Lane inv_pdf = r.scalar(kLightArea) / r.scalar(kLightSelect);
  const Lane p_camera = lens.density * abs(dot(e.normal, to_camera));
  Lane w_hit{};
  if (context.on(kEmissionHits)) w_hit = p_camera * inv_pdf * (1.0f / context.light_samples);  // M10
  const Lane mis = mis_weight(w_hit, Lane{});
  const Lane scale = p_camera * inv_pdf * mis * (context.imaging_ratio * context.splat_scale);
  Candidates c;
  if constexpr (K::kMedia) {
    const LaneInt sides = gather(context.lights.media.data(), e.light);
    c.medium = medium_on_side<Lane>(sides, LaneMask(dot(e.normal, to_camera) > 0.0f));
    c.ratio = w_hit;
    c.seed = volume_seed(context, stream, vertex_dim(0, kDimJoinedVolume));
  }
  c.value = select(valid, radiance * scale, Vec3<Lane>{});
  c.origin = offset_origin(e.point, e.error, e.normal, to_camera);
  c.direction = -(c.origin - lens.lens);
  c.tfar = splat<Lane>(kSegmentEnd);
  c.target = target.pixel;
  c.path = slot;
  c.group = groups_of(w, context.lights, e.light);
  c.lobes.part = splat_int<Lane>(kEmission);
  set_raster(context, lens, stream, vertex_dim(0, kDimSplatSmall), &c);
  // An emitter's pixels get many small splats: for lt they are the whole estimate, for bdpt an addition to s
  // = 0.
  const float tiny = context.lens_alone() ? 0 : context.tiny_contribution;
  const Lane u = tiny > 0 ? stream.get_random(vertex_dim(0, kDimNeeRoulette)) : Lane{};
  if (StrategyRecorder* recorder = recorder_of<K>(w)) {
    FamilyRatios ratios{};
    add_ratio(&ratios, &FamilyShares::lens, splat<Lane>(1.0f));
    add_ratio(&ratios, &FamilyShares::hit, w_hit);
    recorder->announce(splat_int<Lane>(1), 1, slot, slot, mis, ratios);
  }
  queue<K>(context, c, valid, tiny, u, true, w);
}

}  // namespace

void shadow_light_tracing(const StageContext& context, const LayerContext& layer, int depth, size_t first,
                          Wavefront& w) {
  with_kernels(context.kernels.joins, w,
               [&]<class K>(K) { light_tracing<K>(context, layer, depth, first, w); });
}

void queue_emitter_to_lens(const StageContext& context, const LayerContext& layer, LaneInt slot,
                           LaneMask active, const EmissionSample<Lane>& e, Wavefront& w) {
  with_kernels(context.kernels.paths, w,
               [&]<class K>(K) { emitter_to_lens<K>(context, layer, slot, active, e, w); });
}

}  // namespace lightmill
