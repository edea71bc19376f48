#include "worker/render/pipeline/shadow_caster.h"

#include <limits>

#include "worker/render/bsdf/bsdf_dispatch.h"
#include "worker/render/math/compress.h"
#include "worker/render/math/ray_offset.h"
#include "worker/render/pipeline/film.h"
#include "worker/render/pipeline/medium_walk.h"
#include "worker/render/pipeline/splat_target.h"
#include "worker/render/pipeline/stage_probe.h"
#include "worker/render/pipeline/strategy_recorder.h"
#include "worker/render/pipeline/thread_time.h"
#include "worker/render/pipeline/vertex_io.h"
#include "worker/render/pipeline/viewer_side.h"
#include "worker/render/scene/emitter_pattern.h"

namespace lightmill {
namespace {

/// Segments end this fraction short of their target, which they must not hit: rounding of the hit distance is
/// a few ulps of the segment's length.
constexpr float kSegmentEnd = 1 - 0x1p-18f;

/// Contributions that wait for visibility, in lanes.
struct Candidates {
  Vec3<Lane> origin, direction;  // segment from origin to origin + direction, or a ray if infinite
  Lane tfar;
  Vec3<Lane> value;
  LaneInt target;
  // With media: the one that the segment starts in, and w_light + w_camera without P~ of the segment.
  LaneInt medium{};
  Lane ratio{};
  LaneInt light{};  // of next event: MediaWork::shadow_light
};

/// Of the roulette: what is lit by a lamp a billion times weaker than another one may be all that a pixel
/// has.
constexpr float kLeastSurvival = 1.0f / 16;

/// Drops zero contributions (counted), plays roulette for those below `tiny_contribution` with `u`, queues
/// the rest.
template <bool kMedia>
void queue(const StageContext& context, const Candidates& c, LaneMask active, float tiny_contribution, Lane u,
           bool splats, Wavefront& w) {
  const Lane size = max_component(c.value);
  // NaN and negative values go on to the film, which counts them: only exact zeros are dropped here.
  const LaneMask nonzero = mask_and(active, mask_not(LaneMask(size == 0.0f)));
  const unsigned active_bits = mask_bits(active), nonzero_bits = mask_bits(nonzero);
  w.counters.zero_connections_skipped += static_cast<uint64_t>(std::popcount(active_bits & ~nonzero_bits));
  if (!nonzero_bits) {
    if (w.recorder) w.recorder->candidates(active_bits, active_bits, 0);
    return;
  }
  unsigned bits = nonzero_bits;
  Lane scale = splat<Lane>(1.0f);
  if (tiny_contribution > 0) {
    const LaneMask tiny = LaneMask(size < tiny_contribution);
    const Lane q = max(size * (1.0f / tiny_contribution), splat<Lane>(kLeastSurvival));
    const LaneMask lost = mask_and(tiny, LaneMask(u >= q));
    scale = select(tiny, 1.0f / q, scale);
    bits &= ~mask_bits(lost);
    w.counters.rouletted_connections += static_cast<uint64_t>(std::popcount(nonzero_bits & ~bits));
  }
  if (w.recorder) w.recorder->candidates(active_bits, active_bits & ~nonzero_bits, nonzero_bits & ~bits);
  if (w.shadow.count + kLanes > ShadowRays::kCapacity) flush_shadow_rays(context, splats, w);
  ShadowRays& q = w.shadow;
  const Vec3<Lane> value = c.value * scale;
  // There is room for all lanes.
  const auto add = [&](auto* to, const auto& x) { store_compressed(to + q.count, x, bits); };
  add(q.ox, c.origin.x), add(q.oy, c.origin.y), add(q.oz, c.origin.z);
  add(q.dx, c.direction.x), add(q.dy, c.direction.y), add(q.dz, c.direction.z);
  add(q.tfar, c.tfar);
  add(q.r, value.x), add(q.g, value.y), add(q.b, value.z);
  add(q.target, c.target);
  if constexpr (kMedia)
    add(w.media->shadow_medium, c.medium), add(w.media->shadow_ratio, c.ratio),
        add(w.media->shadow_light, c.light);
  if (w.recorder) {
    int i = q.count;
    for (unsigned left = bits; left; left &= left - 1) w.recorder->queued(std::countr_zero(left), i++);
  }
  q.count += std::popcount(bits);
}

/// Both normals see `w` on the same side.
template <bool kMedia>
LaneMask consistent(const VertexLanes<Lane>& v, const Vec3<Lane>& w) {
  const LaneMask same = LaneMask(dot(v.ng, w) * dot(v.ns, w) > 0.0f);
  return kMedia ? mask_or(same, LaneMask(v.kind == kPhaseFunction)) : same;
}

/// The same of a direction towards the camera, where the geometric normal decides (viewer_side.h).
template <bool kMedia>
LaneMask faces_viewer(const VertexLanes<Lane>& v, const Vec3<Lane>& w) {
  const LaneMask some = LaneMask(dot(v.ng, w) * dot(v.ns, w) != 0.0f);
  return kMedia ? mask_or(some, LaneMask(v.kind == kPhaseFunction)) : some;
}

/// `w`, towards the camera, in the frame of v.ns as the BSDF is to see it.
Vec3<Lane> local_viewer(const StageContext& context, const VertexLanes<Lane>& v, const Frame<Lane>& frame,
                        const Vec3<Lane>& w) {
  const Vec3<Lane> local = frame.to_local(w);
  return context.scene.any_shading_normals() ? viewer_direction(local, dot(v.ng, w)) : local;
}

/// Density with which light paths go from the camera vertex `v` to the one before, by that of the BSDF.
Lane reverse_density(const StageContext& context, const VertexLanes<Lane>& v, Lane bsdf_density) {
  return context.scene.any_shading_normals() ? bsdf_density * viewer_density(v, v.wo) : bsdf_density;
}

/// `cosine` on surfaces; in a medium there is none.
template <bool kMedia>
Lane shading_cosine(const VertexLanes<Lane>& v, Lane cosine) {
  return kMedia ? select(LaneMask(v.kind == kPhaseFunction), splat<Lane>(1.0f), cosine) : cosine;
}

/// |wo.ns| |wi.ng| / |wo.ng|: the cosine of a light-path vertex with the adjoint correction.
template <bool kMedia>
Lane adjoint_cosine(const VertexLanes<Lane>& v, const Vec3<Lane>& wi) {
  return shading_cosine<kMedia>(
      v, abs(dot(v.wo, v.ns)) * abs(dot(wi, v.ng)) / max(abs(dot(v.wo, v.ng)), splat<Lane>(1e-12f)));
}

/// What turns a density per unit solid angle into one at the vertex, seen along `w`: the cosine to the
/// geometric normal, in a medium the mean collision rate (mis.h).
template <bool kMedia>
Lane density_cosine(const RenderScene& scene, const VertexLanes<Lane>& v, const Vec3<Lane>& w) {
  const Lane cosine = abs(dot(v.ng, w));
  if constexpr (!kMedia) return cosine;
  const LaneMask inside = LaneMask(v.kind == kPhaseFunction);
  if (!any(inside)) return cosine;
  const MediumRecord<Lane> medium(scene.media.data(), v.media & kMaxMedia);
  return select(inside, medium.scalar(kMediumMeanRate), cosine);
}

/// The medium that a segment from `v` in direction `w` starts in.
LaneInt medium_towards(const VertexLanes<Lane>& v, const Vec3<Lane>& w) {
  return medium_on_side<Lane>(v.media, LaneMask(dot(v.ng, w) > 0.0f));
}

/// A group of up to kLanes consecutive vertices.
struct VertexGroup {
  VertexLanes<Lane> v;
  LaneInt index;
  LaneMask active;
  VertexGroup(const std::vector<Vertex>& from, size_t base, const RenderScene& scene) {
    const auto count = static_cast<int32_t>(std::min<size_t>(kLanes, from.size() - base));
    const LaneInt i = lane_index<Lane>();
    active = LaneMask(i < count);
    index = i + static_cast<int32_t>(base);
    v = load_vertices(from.data() + base, select(active, i, splat_int<Lane>(count - 1)));
    v.params.tables = scene.bsdf_tables.data();
  }
};

/// Joins points `p` to the camera; the lens sample is dimension `dim` of `stream`, if there is a lens.
LensConnection<Lane> connect_lens(const StageContext& context, const SampleStream<Lane>& stream, uint32_t dim,
                                  const Vec3<Lane>& p) {
  return std::visit(
      [&](const auto& camera) {
        Lane u{}, v{};
        if constexpr (std::decay_t<decltype(camera)>::kHasLens) stream.get_2d(dim, &u, &v);
        return camera.connect(p, u, v);
      },
      context.camera);
}

template <bool kMedia>
void next_event(const StageContext& context, const LayerContext& layer, int depth, Wavefront& w) {
  const LightTable& lights = context.scene.lights;
  if (lights.count() == 0) return;
  // This vertex is the depth-th scattering event.
  const bool weigh_connections = context.on(kLightPaths) && depth <= kMaxLightVertices;
  for (size_t base = 0; base < w.vertices.size(); base += kLanes) {
    const VertexGroup g(w.vertices, base, context.scene);
    const VertexLanes<Lane>& v = g.v;
    const SampleStream<Lane> stream = layer.camera_stream<Lane>(v.path);
    Lane lu, lv;
    stream.get_2d(vertex_dim(depth, kDimNeePosition), &lu, &lv);
    const Lane pick = lights.count() > 1 ? stream.get_1d(vertex_dim(depth, kDimNeeSelect)) : Lane{};
    const Lane texel = lights.environments.empty() && lights.tree.empty()
                           ? Lane{}
                           : stream.get_1d(vertex_dim(depth, kDimNeeTexel));
    DirectSample<Lane> d = sample_direct(lights, v.p, pick, texel, lu, lv);
    if (!lights.patterns.empty()) apply_pattern(context.scene, g.active, &d);
    const LaneMask lit = mask_and(mask_and(g.active, LaneMask(max_component(d.radiance) > 0.0f)),
                                  mask_and(LaneMask(d.pdf > 0.0f), consistent<kMedia>(v, d.wi)));
    const Frame<Lane> frame(v.ns);
    const Vec3<Lane> wi = frame.to_local(d.wi);
    BsdfEval<Lane> f =
        eval_bsdf<Lane>(v.kind, lit, v.params, local_viewer(context, v, frame, v.wo), wi, Mode::kRadiance);
    f.pdf_reverse = reverse_density(context, v, f.pdf_reverse);
    const Lane inv_pdf = 1.0f / select(lit, d.pdf, splat<Lane>(1.0f));
    const Lane w_light = context.on(kEmissionHits) ? select(d.delta, Lane{}, f.pdf * inv_pdf) : Lane{};
    Lane camera_ratio{}, w_camera{};
    if (weigh_connections) {
      const Lane cos_surface = density_cosine<kMedia>(context.scene, v, d.wi);
      const Lane cos_light = select(lit, d.cos_light, splat<Lane>(1.0f));
      camera_ratio = d.pdf_emission * cos_surface * inv_pdf / cos_light;
      w_camera = camera_ratio * (v.dvcm + v.dvc * f.pdf_reverse);  // M7
    }
    const Lane mis = mis_weight(w_light, w_camera);
    const Lane scale = shading_cosine<kMedia>(v, abs(wi.z)) * inv_pdf * mis * context.imaging_ratio;
    Candidates c;
    if constexpr (kMedia) {
      c.medium = medium_towards(v, d.wi), c.ratio = w_light + w_camera;
      c.light = d.light * 2 + select(LaneMask(dot(d.normal, d.wi) < 0.0f), splat_int<Lane>(1), LaneInt{});
    }
    c.value = select(lit, v.throughput * f.f * d.radiance * scale, Vec3<Lane>{});
    c.origin = offset_origin(v.p, v.error, v.ng, d.wi);
    const Vec3<Lane> end = offset_origin(d.point, d.error, d.normal, -d.wi);
    c.direction = select(d.infinite, d.wi, end - c.origin);
    c.tfar =
        select(d.infinite, splat<Lane>(std::numeric_limits<float>::infinity()), splat<Lane>(kSegmentEnd));
    c.target = v.path;
    const Lane u =
        context.tiny_contribution > 0 ? stream.get_random(vertex_dim(depth, kDimNeeRoulette)) : Lane{};
    if (w.recorder) {
      FamilyRatios ratios{};
      add_ratio(&ratios, &FamilyShares::next_event, splat<Lane>(1.0f));
      add_ratio(&ratios, &FamilyShares::hit, w_light);
      w.recorder->add_stored(false, g.index, v.depth, camera_ratio, v.dvcm, v.dvc, f.pdf_reverse, &ratios);
      w.recorder->announce(splat_int<Lane>(1), depth + 1, v.path, mis, ratios);
    }
    queue<kMedia>(context, c, g.active, context.tiny_contribution, u, false, w);
  }
}

template <bool kMedia>
void connections(const StageContext& context, const LayerContext& layer, int depth, Wavefront& w) {
  const int longest = std::min(context.max_depth, kMaxLightVertices) - depth;
  const auto cached = static_cast<int32_t>(w.light_vertices.size());
  if (longest < 1 || cached == 0) return;
  // Systematic sampling of the cache: every step-th vertex from a random start, so that each has probability
  // 1 / step, and the picks of one camera vertex are spread over the depths that the cache is ordered by.
  const float step = static_cast<float>(layer.light_paths) / context.connections;
  const float inv_connections = 1.0f / context.connections;
  for (size_t base = 0; base < w.vertices.size(); base += kLanes) {
    const VertexGroup g(w.vertices, base, context.scene);
    const VertexLanes<Lane>& v = g.v;
    const SampleStream<Lane> stream = layer.camera_stream<Lane>(v.path);
    const Lane start = stream.get_1d(vertex_dim(depth, kDimConnectStart)) * step;
    const Frame<Lane> frame(v.ns);
    const Vec3<Lane> wo = local_viewer(context, v, frame, v.wo);
    for (uint32_t j = 0;; ++j) {
      const LaneInt pick = to_int(start + static_cast<float>(j) * step);
      LaneMask active = mask_and(g.active, LaneMask(pick < cached));
      if (!any(active)) break;
      const LaneInt index = select(active, pick, LaneInt{});
      VertexLanes<Lane> l = load_vertices(w.light_vertices.data(), index);
      l.params.tables = context.scene.bsdf_tables.data();
      active = mask_and(active, LaneMask(l.depth <= longest));
      if (!any(active)) continue;
      const Vec3<Lane> to_light = l.p - v.p;
      const Lane d2 = dot(to_light, to_light);
      const LaneMask apart = LaneMask(d2 > 0.0f);
      const Lane inv_d2 = 1.0f / select(apart, d2, splat<Lane>(1.0f));
      const Vec3<Lane> wi = to_light * sqrt(inv_d2);
      const LaneMask valid = mask_and(mask_and(active, apart),
                                      mask_and(consistent<kMedia>(v, wi), faces_viewer<kMedia>(l, -wi)));
      const Vec3<Lane> wi_local = frame.to_local(wi);
      BsdfEval<Lane> f = eval_bsdf<Lane>(v.kind, valid, v.params, wo, wi_local, Mode::kRadiance);
      f.pdf_reverse = reverse_density(context, v, f.pdf_reverse);
      const Frame<Lane> light_frame(l.ns);
      BsdfEval<Lane> fl = eval_bsdf<Lane>(l.kind, valid, l.params, light_frame.to_local(l.wo),
                                          local_viewer(context, l, light_frame, -wi), Mode::kImportance);
      if (context.scene.any_shading_normals()) fl.pdf = fl.pdf * viewer_density(l, -wi);
      const Lane cos_v = density_cosine<kMedia>(context.scene, v, wi),
                 cos_l = density_cosine<kMedia>(context.scene, l, wi);
      const Lane light_ratio = f.pdf * cos_l * inv_d2, camera_ratio = fl.pdf * cos_v * inv_d2;
      const Lane w_light = light_ratio * (l.dvcm + l.dvc * fl.pdf_reverse);
      const Lane w_camera = camera_ratio * (v.dvcm + v.dvc * f.pdf_reverse);
      // M9; over the samples of the connection itself, which the contribution is divided by in turn.
      const Lane mis = mis_weight(w_light * inv_connections, w_camera * inv_connections);
      const Lane geometry = inv_connections * shading_cosine<kMedia>(v, abs(wi_local.z)) *
                            adjoint_cosine<kMedia>(l, -wi) * inv_d2;
      Candidates c;
      if constexpr (kMedia)
        c.medium = medium_towards(v, wi), c.ratio = (w_light + w_camera) * inv_connections;
      c.value =
          select(valid, v.throughput * l.throughput * f.f * fl.f * (geometry * mis * context.imaging_ratio),
                 Vec3<Lane>{});
      c.origin = offset_origin(v.p, v.error, v.ng, wi);
      c.direction = offset_origin(l.p, l.error, l.ng, -wi) - c.origin;
      c.tfar = splat<Lane>(kSegmentEnd);
      c.target = v.path;
      const Lane u =
          context.tiny_contribution > 0
              ? stream.get_random(vertex_dim(depth, kDimConnectRoulette + j % kConnectRouletteDims))
              : Lane{};
      if (w.recorder) {
        FamilyRatios ratios{};
        add_ratio(&ratios, &FamilyShares::connect, splat<Lane>(1.0f));
        w.recorder->add_stored(false, g.index, v.depth, camera_ratio * inv_connections, v.dvcm, v.dvc,
                               f.pdf_reverse, &ratios);
        w.recorder->add_stored(true, index, l.depth, light_ratio * inv_connections, l.dvcm, l.dvc,
                               fl.pdf_reverse, &ratios);
        w.recorder->announce(l.depth + 1, depth + 1, v.path, mis, ratios);
      }
      queue<kMedia>(context, c, active, context.tiny_contribution, u, false, w);
    }
  }
}

template <bool kMedia>
void lens_connections(const StageContext& context, const LayerContext& layer, int depth, size_t first,
                      Wavefront& w) {
  for (size_t base = first; base < w.light_vertices.size(); base += kLanes) {
    const VertexGroup g(w.light_vertices, base, context.scene);
    const VertexLanes<Lane>& v = g.v;
    const SampleStream<Lane> stream = layer.light_stream<Lane>(v.path);
    const LensConnection<Lane> lens = connect_lens(context, stream, vertex_dim(depth, kDimSplatLens), v.p);
    const Vec3<Lane>& to_camera = lens.direction;
    const LaneMask seen = mask_and(mask_and(g.active, lens.seen), faces_viewer<kMedia>(v, to_camera));
    if (!any(seen)) continue;
    Lane fu, fv;
    stream.get_2d(vertex_dim(depth, kDimSplatPixel), &fu, &fv);
    const SplatTarget target(context, lens.x, lens.y, fu, fv, seen);
    const LaneMask valid = mask_and(seen, LaneMask(target.weight > 0.0f));
    if (!any(valid)) continue;
    const Frame<Lane> frame(v.ns);
    const BsdfEval<Lane> f = eval_bsdf<Lane>(v.kind, valid, v.params, frame.to_local(v.wo),
                                             local_viewer(context, v, frame, to_camera), Mode::kImportance);
    const Lane p_camera = lens.density * density_cosine<kMedia>(context.scene, v, to_camera);
    const Lane light_ratio = p_camera * target.inv_light_samples;
    const Lane w_light = light_ratio * (v.dvcm + v.dvc * f.pdf_reverse);  // M8
    const Lane mis = mis_weight(w_light, Lane{});
    const Lane scale = lens.density * adjoint_cosine<kMedia>(v, to_camera) * target.weight * mis *
                       (context.imaging_ratio * context.splat_scale);
    Candidates c;
    if constexpr (kMedia) c.medium = medium_towards(v, to_camera), c.ratio = w_light;
    c.value = select(valid, v.throughput * f.f * scale, Vec3<Lane>{});
    c.origin = offset_origin(v.p, v.error, v.ng, to_camera);
    c.direction = -(c.origin - lens.lens);
    c.tfar = splat<Lane>(kSegmentEnd);
    c.target = target.pixel;
    const Lane u =
        context.tiny_contribution > 0 ? stream.get_random(vertex_dim(depth, kDimNeeRoulette)) : Lane{};
    if (w.recorder) {
      FamilyRatios ratios{};
      add_ratio(&ratios, &FamilyShares::lens, splat<Lane>(1.0f));
      w.recorder->add_stored(true, g.index, v.depth, light_ratio, v.dvcm, v.dvc, f.pdf_reverse, &ratios);
      w.recorder->announce(splat_int<Lane>(depth + 1), 1, v.path, mis, ratios);
    }
    queue<kMedia>(context, c, valid, context.tiny_contribution, u, true, w);
  }
  flush_shadow_rays(context, true, w);
}

template <bool kMedia>
void emitter_to_lens(const StageContext& context, const LayerContext& layer, LaneInt slot, LaneMask active,
                     const EmissionSample<Lane>& e, Wavefront& w) {
  const LaneMask surface = mask_and(active, mask_not(mask_or(e.delta, e.infinite)));
  if (!any(surface)) return;
  const SampleStream<Lane> stream = layer.light_stream<Lane>(slot);
  const LensConnection<Lane> lens = connect_lens(context, stream, vertex_dim(0, kDimSplatLens), e.point);
  const Vec3<Lane>& to_camera = lens.direction;
  const LaneMask seen = mask_and(surface, lens.seen);
  if (!any(seen)) return;
  Lane fu, fv;
  stream.get_2d(vertex_dim(0, kDimSplatPixel), &fu, &fv);
  const SplatTarget target(context, lens.x, lens.y, fu, fv, seen);
  const LaneMask valid = mask_and(seen, LaneMask(target.weight > 0.0f));
  Vec3<Lane> radiance = emitted_radiance(context.scene.lights, e.light, e.normal, to_camera);
  if (!context.scene.lights.patterns.empty()) radiance = radiance * e.pattern;
  // Density of the point alone: selection / area.
  const LightRecord<Lane> r(context.scene.lights, e.light);
  const Lane inv_pdf = r.scalar(kLightArea) / r.scalar(kLightSelect);
  const Lane p_camera = lens.density * abs(dot(e.normal, to_camera));
  Lane w_hit{};
  if (context.on(kEmissionHits)) w_hit = p_camera * inv_pdf * target.inv_light_samples;  // M10
  const Lane mis = mis_weight(w_hit, Lane{});
  const Lane scale = p_camera * inv_pdf * target.weight * mis * (context.imaging_ratio * context.splat_scale);
  Candidates c;
  if constexpr (kMedia) {
    const LaneInt sides = gather(context.scene.lights.media.data(), e.light);
    c.medium = medium_on_side<Lane>(sides, LaneMask(dot(e.normal, to_camera) > 0.0f));
    c.ratio = w_hit;
  }
  c.value = select(valid, radiance * scale, Vec3<Lane>{});
  c.origin = offset_origin(e.point, e.error, e.normal, to_camera);
  c.direction = -(c.origin - lens.lens);
  c.tfar = splat<Lane>(kSegmentEnd);
  c.target = target.pixel;
  // An emitter's pixels get many small splats: for lt they are the whole estimate, for bdpt a help beside s =
  // 0.
  const float tiny = context.lens_alone() ? 0 : context.tiny_contribution;
  const Lane u = tiny > 0 ? stream.get_random(vertex_dim(0, kDimNeeRoulette)) : Lane{};
  if (w.recorder) {
    FamilyRatios ratios{};
    add_ratio(&ratios, &FamilyShares::lens, splat<Lane>(1.0f));
    add_ratio(&ratios, &FamilyShares::hit, w_hit);
    w.recorder->announce(splat_int<Lane>(1), 1, slot, mis, ratios);
  }
  queue<kMedia>(context, c, valid, tiny, u, true, w);
}

}  // namespace

void flush_shadow_rays(const StageContext& context, bool splats, Wavefront& w) {
  ShadowRays& q = w.shadow;
  if (q.count == 0) return;
  const double start = w.recorder ? thread_cpu_seconds() : 0;
  if (w.probe) w.probe->occluded(q);
  {
    const StageScope scope(w, Stage::kOcclude);
    if (w.media) {
      trace_transmittance(context, w);
    } else {
      context.accel.occluded({q.ox, q.oy, q.oz, q.dx, q.dy, q.dz}, q.tfar, q.count, q.occluded);
    }
  }
  w.counters.shadow_rays += static_cast<uint64_t>(q.count);
  if (w.recorder) w.recorder->resolved(q, splats, thread_cpu_seconds() - start, w.media.get());
  const StageScope scope(w, Stage::kFilm);
  if (splats) {
    film_add_splats(w);
  } else {
    film_add_to_paths(w);
  }
  q.count = 0;
}

void shadow_next_event(const StageContext& context, const LayerContext& layer, int depth, Wavefront& w) {
  if (w.media) return next_event<true>(context, layer, depth, w);
  next_event<false>(context, layer, depth, w);
}

void shadow_connections(const StageContext& context, const LayerContext& layer, int depth, Wavefront& w) {
  if (w.media) return connections<true>(context, layer, depth, w);
  connections<false>(context, layer, depth, w);
}

void shadow_lens(const StageContext& context, const LayerContext& layer, int depth, size_t first,
                 Wavefront& w) {
  if (w.media) return lens_connections<true>(context, layer, depth, first, w);
  lens_connections<false>(context, layer, depth, first, w);
}

void queue_emitter_to_lens(const StageContext& context, const LayerContext& layer, LaneInt slot,
                           LaneMask active, const EmissionSample<Lane>& e, Wavefront& w) {
  if (w.media) return emitter_to_lens<true>(context, layer, slot, active, e, w);
  emitter_to_lens<false>(context, layer, slot, active, e, w);
}

}  // namespace lightmill
