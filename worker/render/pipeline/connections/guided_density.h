#pragma once
// What the photon guide (guiding/photon_guide.h) does to the densities of camera paths. Every MIS weight asks
// here how camera paths scatter. Light paths don't use the guide.
#include "worker/render/bsdf/bsdf_dispatch.h"
#include "worker/render/pipeline/paths/vertex_io.h"
#include "worker/render/pipeline/recording/strategy_recorder.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// Density with which camera paths leave `v` in direction `w`, per unit solid angle. `of_bsdf`: that of its
/// BSDF.
inline Lane camera_density(const RenderScene& scene, const VertexLanes<Lane>& v, const Vec3<Lane>& w,
                           LaneMask active, Lane of_bsdf) {
  if (scene.caustics.empty()) return of_bsdf;
  const PhotonGuideTables<Lane> tables(scene.caustics, active, v.kind, v.p);
  if (!any(tables.mask)) return of_bsdf;
  return select(tables.mask, scene.caustics.mixed(of_bsdf, tables.density(w)), of_bsdf);
}

/// The same for a light vertex, in the direction that its path came from.
inline Lane camera_density(const RenderScene& scene, const VertexLanes<Lane>& v, Lane of_bsdf) {
  if (scene.caustics.empty()) return of_bsdf;
  return select(LaneMask(v.guide >= 0.0f), scene.caustics.mixed(of_bsdf, v.guide), of_bsdf);
}

/// Stores the guide's density in light vertices.
inline void add_guide(const RenderScene& scene, LaneMask active, VertexLanes<Lane>* v) {
  if (scene.caustics.empty()) return;
  const PhotonGuideTables<Lane> tables(scene.caustics, active, v->kind, v->p);
  if (any(tables.mask)) v->guide = select(tables.mask, tables.density(v->wo), v->guide);
}

/// How a group of camera paths leaves its vertices where some have tables of the guide.
class GuidedScattering {
 public:
  /// Chooses the paths that go by the tables by `lobe_u`, the random number of the BSDF's lobe. The others
  /// get what is left of it.
  GuidedScattering(const PhotonGuide& guide, const PhotonGuideTables<Lane>& tables, Lane* lobe_u)
      : guide_(guide), share_(guide.share), tables_(tables) {
    by_guide_ = mask_and(tables.mask, LaneMask(*lobe_u < share_));
    const Lane rest = clamp((*lobe_u - share_) * (1 / (1 - share_)), 0.0f, 1 - 0x1p-24f);
    *lobe_u = select(tables.mask, rest, *lobe_u);
  }

  /// Replaces those of the BSDF's samples `s` whose paths go by the tables; `wi` is their direction in the
  /// world. The weight stays f cos / the BSDF's density, as roulette is to judge by that.
  void redirect(const VertexLanes<Lane>& v, const Frame<Lane>& frame, const Vec3<Lane>& wo, Lane du, Lane dv,
                BsdfSample<Lane>* s, Vec3<Lane>* wi) const {
    if (!any(by_guide_)) return;
    const Vec3<Lane> there = tables_.draw(du, dv), local = frame.to_local(there);
    const BsdfEval<Lane> e = eval_bsdf<Lane>(v.kind, by_guide_, v.params, wo, local, Mode::kRadiance);
    const LaneMask scatters = LaneMask(e.pdf > 0.0f);
    *wi = select(by_guide_, there, *wi);
    s->wi = select(by_guide_, local, s->wi);
    s->weight =
        select(by_guide_, e.f * (abs(local.z) / select(scatters, e.pdf, splat<Lane>(1.0f))), s->weight);
    s->pdf = select(by_guide_, e.pdf, s->pdf);
    s->pdf_reverse = select(by_guide_, e.pdf_reverse, s->pdf_reverse);
    s->roulette_scale = select(by_guide_, splat<Lane>(1.0f), s->roulette_scale);
    s->valid = mask_or(mask_and(s->valid, mask_not(by_guide_)), mask_and(by_guide_, scatters));
  }

  /// The BSDF's density of `s`, in direction `wi` of the world, over that of camera paths. `odds` per lane:
  /// what other shares of the guide would make of it.
  Lane bsdf_over_mixed(const BsdfSample<Lane>& s, const Vec3<Lane>& wi,
                       std::array<GuideOdds, kLanes>* odds) const {
    const Lane of_guide = tables_.density(wi), mixed = guide_.mixed(s.pdf, of_guide);
    if (odds) {
      for (int l = 0; l < kLanes; ++l) {
        if (!lane_in(tables_.mask, l)) continue;
        (*odds)[static_cast<size_t>(l)] = odds_of(lane(s.pdf, l), lane(of_guide, l), lane(mixed, l));
      }
    }
    const LaneMask chosen = mask_and(tables_.mask, LaneMask(mixed > 0.0f));
    return select(chosen, s.pdf / select(chosen, mixed, splat<Lane>(1.0f)), splat<Lane>(1.0f));
  }

 private:
  static bool lane_in(LaneMask mask, int l) { return mask_bits(mask) >> l & 1; }
  static GuideOdds odds_of(float of_bsdf, float of_guide, float mixed) {
    GuideOdds odds;
    for (size_t k = 0; k < odds.size(); ++k) {
      const float share = kGuideShares[k];
      odds[k] = ((1 - share) * of_bsdf + share * of_guide) / std::max(mixed, 1e-30f);
    }
    return odds;
  }

  const PhotonGuide& guide_;
  float share_;
  const PhotonGuideTables<Lane>& tables_;
  LaneMask by_guide_;
};

}  // namespace lightmill
