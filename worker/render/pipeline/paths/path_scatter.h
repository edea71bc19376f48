#pragma once
// Scattering in stage 3: how paths go on from their vertices.
#include <bit>
#include <optional>

#include "worker/render/pipeline/connections/guided_density.h"
#include "worker/render/pipeline/paths/first_event.h"
#include "worker/render/pipeline/paths/path_kinds.h"
#include "worker/render/pipeline/paths/path_radiance.h"
#include "worker/render/pipeline/paths/path_vertex.h"
#include "worker/render/pipeline/paths/roulette.h"
#include "worker/render/pipeline/paths/viewer_side.h"
#include "worker/render/pipeline/recording/strategy_recorder.h"

namespace lightmill {

/// Counts paths that end because their throughput is not a number.
inline void count_lost_paths(LaneInt slot, LaneMask lost, Mode mode, Wavefront& w) {
  for (unsigned bits = mask_bits(lost); bits; bits &= bits - 1) {
    if (mode == Mode::kImportance) {
      drop_not_finite_light(w);
    } else {
      drop_not_finite(w, static_cast<size_t>(lane(slot, std::countr_zero(bits))));
    }
  }
}

/// Samples the BSDF, updates throughput and MIS terms (M4, M5, M11), plays roulette, writes the next ray.
/// Returns the lanes that go on. Those that enter a body are handed to subsurface_walk.h instead.
template <class K>
LaneMask scatter_paths(const StageContext& context, const SampleStream<Lane>& stream, const Hit& h,
                       LaneMask active, Mode mode, int depth, bool keep_dvc, Wavefront& w) {
  const VertexLanes<Lane>& v = h.v;
  const Frame<Lane> frame(v.ns);
  Vec3<Lane> wo = frame.to_local(v.wo);
  const bool tilted_normals = context.scene.any_shading_normals();
  if (tilted_normals && mode == Mode::kRadiance) wo = viewer_direction(wo, dot(v.ng, v.wo));
  Lane du = h.du, dv = h.dv;
  if (!h.drawn) stream.get_2d(vertex_dim(depth, kDimBsdfDirection), &du, &dv);
  const PhotonGuide& caustics = context.scene.caustics;
  const bool has_guide = K::kSurfaces && !caustics.empty();
  std::optional<PhotonGuideTables<Lane>> tables;
  if (has_guide && mode == Mode::kRadiance) tables.emplace(caustics, active, v.kind, v.p);
  const bool guided = tables && any(tables->mask);
  // One lobe needs no choice.
  const bool lobes = K::kSurfaces && (guided || any(mask_not(LaneMask(v.kind == kDiffuse))));
  Lane lobe_u = lobes ? stream.get_1d(vertex_dim(depth, kDimBsdfLobe)) : Lane{};
  // Sharp lobes have no other use for it: so it is stratified together with the choices before.
  if (lobes && h.drawn) lobe_u = select(mask_and(h.chosen, pure_delta<Lane>(v.kind)), du, lobe_u);
  std::optional<GuidedScattering> by_guide;
  if (guided) by_guide.emplace(caustics, *tables, &lobe_u);
  BsdfSample<Lane> s = sample_bsdf<Lane, K::kSurfaces>(v.kind, active, v.params, wo, lobe_u, du, dv, mode);
  Vec3<Lane> wi = frame.to_world(s.wi);
  if (by_guide) by_guide->redirect(v, frame, wo, du, dv, &s, &wi);
  // The direction must lie on the side of both normals that the BSDF meant.
  Lane cos_g = dot(v.ng, wi);
  LaneMask same_side = LaneMask(cos_g * s.wi.z > 0.0f);
  LaneMask in_medium = splat_mask<Lane>(false);
  if constexpr (K::kMedia) {
    in_medium = LaneMask(v.kind == kPhaseFunction);
    same_side = mask_or(same_side, in_medium);
  }
  // A path that enters a body has no direction yet, and roulette waits until it leaves.
  const bool bodies = K::kSurfaces && context.scene.any_bodies;
  LaneMask enters = splat_mask<Lane>(false);
  if (bodies) {
    enters = mask_and(enters_bodies<Lane>(v.kind), LaneMask(s.wi.z * wo.z < 0.0f));
    same_side = mask_or(same_side, enters);
    cos_g = select(enters, splat<Lane>(1.0f), cos_g);
  }
  LaneMask go = mask_and(mask_and(active, s.valid), same_side);
  Vec3<Lane> weight = s.weight;
  Lane pdf = s.pdf, pdf_reverse = s.pdf_reverse, delta_ratio = splat<Lane>(1.0f);
  if (tilted_normals && mode == Mode::kRadiance) {
    delta_ratio = viewer_density(v, v.wo);
    pdf_reverse = pdf_reverse * delta_ratio;
  } else if (tilted_normals) {
    // The direction or its mirror image (viewer_side.h).
    const Lane tilt = dot(v.ns, v.ng);
    const LaneMask two = mask_and(has_mirror_image(s.wi.z, cos_g, tilt), mask_not(enters));
    const LaneMask mirror = mask_and(two, LaneMask(stream.get_1d(vertex_dim(depth, kDimViewerSide)) < 0.5f));
    wi = select(mirror, wi - v.ns * (2.0f * s.wi.z), wi);
    cos_g = select(mirror, cos_g - 2.0f * s.wi.z * tilt, cos_g);
    delta_ratio = select(two, splat<Lane>(2.0f), splat<Lane>(1.0f));
    weight = weight * delta_ratio;
    pdf = select(s.delta, pdf, pdf * select(two, splat<Lane>(0.5f), splat<Lane>(1.0f)));
    // Adjoint of shading normals (Veach 1997, eq. 5.19): |wo.ns| |wi.ng| / (|wo.ng| |wi.ns|).
    const Lane correction = abs(wo.z) * abs(cos_g) / (h.cos_in * max(abs(s.wi.z), splat<Lane>(1e-12f)));
    const LaneMask tilted =
        mask_or(mask_or(LaneMask(v.ns.x != v.ng.x), LaneMask(v.ns.y != v.ng.y)), LaneMask(v.ns.z != v.ng.z));
    weight = select(tilted, weight * correction, weight);
  }
  Lane guided_weight = splat<Lane>(1.0f);
  StrategyRecorder* const recorder = recorder_of<K>(w);
  std::array<GuideOdds, kLanes> odds;
  const bool weighs = recorder && recorder->weigh_guide && mode == Mode::kRadiance;
  if (weighs) odds.fill(kEvenOdds);
  if (by_guide) {
    guided_weight = by_guide->bsdf_over_mixed(s, wi, weighs ? &odds : nullptr);
    pdf =
        select(s.delta, pdf, pdf / select(LaneMask(guided_weight > 0.0f), guided_weight, splat<Lane>(1.0f)));
  } else if (has_guide && mode == Mode::kImportance) {
    pdf_reverse = camera_density(context.scene, v, pdf_reverse);  // of camera paths that come the other way
  }
  if (weighs) recorder->scatter_by_guide(v.path, active, odds);
  Vec3<Lane> throughput = v.throughput * weight;
  const Lane after = max_component(throughput) * s.roulette_scale;
  Lane before = K::kMedia ? gather(w.media->before, v.path) : max_component(h.path.throughput);
  if (bodies) before = select(leaves_bodies<Lane>(v.kind), gather(w.bodies->before, v.path), before);
  const LaneMask lost = mask_and(go, mask_not(LaneMask(after == after)));
  if (any(lost)) count_lost_paths(v.path, lost, mode, w);
  go = mask_and(go, LaneMask(after > 0.0f));
  const int rr_depth = mode == Mode::kRadiance ? context.rr_depth : kLightRrDepth;
  // Survival is the loss of throughput at this event, so that the product over a path tracks its throughput.
  const auto survival = [&] {
    const Lane q = min(after / before, splat<Lane>(roulette_cap(depth)));
    return bodies ? select(enters, splat<Lane>(1.0f), q) : q;
  };
  if (recorder && mode == Mode::kRadiance && depth == kLeastRrDepth)
    recorder->roulette(v.path, go, depth < rr_depth ? survival() : splat<Lane>(1.0f));
  if (depth >= rr_depth) {
    const Lane q = survival();
    const Lane u = stream.get_1d(vertex_dim(depth, kDimRoulette));
    go = mask_and(go, LaneMask(u < q));
    throughput = throughput * (1.0f / select(LaneMask(q > 0.0f), q, splat<Lane>(1.0f)));
  }
  throughput = throughput * guided_weight;
  if (!any(go)) return go;
  const Lane cos_out = K::kMedia ? select(in_medium, h.cos_in, abs(cos_g)) : abs(cos_g);
  const Lane inv_pdf = 1.0f / pdf;
  const Lane dvc = select(s.delta, v.dvc * (cos_out * delta_ratio),
                          cos_out * inv_pdf * (v.dvc * pdf_reverse + v.dvcm));  // M4, M5
  const Lane dvcm = select(s.delta, Lane{}, inv_pdf);
  if (recorder) {
    const Lane gain = select(s.delta, cos_out * delta_ratio, cos_out * inv_pdf * pdf_reverse);
    const Lane own = select(s.delta, Lane{}, cos_out * inv_pdf * v.dvcm);
    recorder->scatter(mode == Mode::kImportance, depth, v.path, go, gain, own);
  }
  PathLanes<Lane> next{offset_origin(v.p, v.error, v.ng, wi), wi, throughput, dvcm};
  if (keep_dvc) next.dvc = dvc;
  if constexpr (K::kMedia) next.medium = medium_on_side<Lane>(v.media, LaneMask(cos_g > 0.0f));
  if (bodies && any(enters)) {
    enters = mask_and(enters, go);
    go = mask_and(go, mask_not(enters));
    next.dvcm = Lane{};
    if constexpr (K::kMedia) next.medium = select(enters, h.path.medium, next.medium);
    enter_bodies(context, stream, depth, v, h.path.prim, next, enters, w);
    next.dvcm = dvcm;
  }
  LobedLight* const kept = lobes_of<K>(w);
  if (kept && depth == 1 && mode == Mode::kRadiance) keep_first_event(v, go, s.delta, wo, s.wi, kept);
  store_paths(next, v.path, mask_bits(go), &w.paths);
  if (context.scene.tracks_ray_kinds() && mode == Mode::kRadiance) set_ray_kinds(v, wi, s.delta, go, w.paths);
  return go;
}

/// Vertices with a lobe that is not a delta. A path that enters a body can be joined where it leaves.
template <class K>
LaneMask connectable_lanes(const Hit& h) {
  if constexpr (!K::kSurfaces) return h.valid;
  const LaneMask none = mask_or(pure_delta<Lane>(h.v.kind), LaneMask(h.v.kind == kSubsurface));
  return mask_and(h.valid, mask_not(none));
}

}  // namespace lightmill
