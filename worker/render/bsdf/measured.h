#pragma once
// Measured BRDFs (Dupuy & Jakob 2018; the tables: common/scene/measured/measured_table.h), reflecting on both
// sides.
//
// The tables are not exactly reciprocal. f is that of a viewer on the camera's side, as in pbrt-v4, so that
// light paths and camera paths agree. A share of directions is sampled by the cosine: seen from the
// light's side the tables' own densities may leave out what is seen from the other.
//
// Parameters: 0 place of the head in the tables, in units of kMeasuredUnit; 9 as anisotropic.h says.
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/ggx.h"
#include "worker/render/bsdf/measured_warp.h"
#include "worker/render/math/angle.h"
#include "worker/render/sampling/warp.h"

namespace lightmill {

inline constexpr float kMeasuredCosineShare = 1.0f / 16;

/// A measured surface seen from `o`, a unit vector in the lobe's axes.
template <class F>
class MeasuredView {
 public:
  /// Lanes that are not `of_kind` get the table of one that is, of which there must be one.
  MeasuredView(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& o)
      : tables_(params.tables),
        head_(head_of(params, of_kind)),
        o_{select(of_kind, o.x, F{}), select(of_kind, o.y, F{}), select(of_kind, abs(o.z), splat<F>(1.0f))},
        isotropic_(MaskOf<F>(integer(kMeasuredIsotropic) != 0)),
        sine_(sqrt(o_.x * o_.x + o_.y * o_.y)),
        turn_from_zenith_(turns(sine_, o_.z)),
        turn_(turns(o_.y, o_.x)),
        views_(tables_, head_, azimuth(), turn_from_zenith_ * (2 * kPi)),
        visible_(tables_, head_, kMeasuredVisible, views_),
        luminance_(tables_, head_, kMeasuredLuminance, views_) {
    const MaskOf<F> round = mask_and(isotropic_, MaskOf<F>(sine_ > 0.0f));
    const F scale = 1.0f / select(round, sine_, splat<F>(1.0f));
    ex_ = select(round, o_.x * scale, splat<F>(1.0f));
    ey_ = select(round, o_.y * scale, F{});
  }
  MeasuredView(const MeasuredView&) = delete;
  MeasuredView& operator=(const MeasuredView&) = delete;

  /// Density of sampling `i` (above, as o), and f if `colour` is not null.
  F eval(const Vec3<F>& i, Vec3<F>* colour) const {
    const Vec3<F> sum = o_ + i;
    const F length2 = dot(sum, sum);
    const MaskOf<F> valid = MaskOf<F>(length2 > 0.0f);
    const Vec3<F> m = sum * (1.0f / sqrt(select(valid, length2, splat<F>(1.0f))));
    const F sine = sqrt(m.x * m.x + m.y * m.y);
    const F x = square_of_zenith(turns(sine, m.z));
    const F y = square_of_turn(turns(m.y * ex_ - m.x * ey_, m.x * ex_ + m.y * ey_));
    const auto q = visible_.invert(x, y);
    if (colour) {
      const F sigma = flat(kMeasuredSigma, square_of_zenith(turn_from_zenith_), square_of_turn(turn_));
      const MaskOf<F> lit = mask_and(valid, MaskOf<F>(sigma > 0.0f));
      const F across = 4.0f * select(lit, sigma, splat<F>(1.0f)) * max(i.z, splat<F>(1e-12f));
      *colour = select(lit, reflected(q.x, q.y) * (flat(kMeasuredNdf, x, y) / across), Vec3<F>{});
    }
    // Per solid angle: dm = 2 pi^2 x sin(theta_m) dx dy, and i turns by twice the facet.
    const F area = max(2 * kPi * kPi * x * sine, splat<F>(1e-6f)) * (4.0f * dot(o_, m));
    const MaskOf<F> faces = mask_and(valid, MaskOf<F>(area > 0.0f));
    return select(faces, q.density * luminance_.density(q.x, q.y) / select(faces, area, splat<F>(1.0f)), F{});
  }
  /// A direction with the density above; it may lie below the surface.
  Vec3<F> sample(F u, F v) const {
    const auto q = luminance_.sample(u, v);
    const auto p = visible_.sample(q.x, q.y);
    F sine, cosine, s, c;
    sincos_2pi(0.25f * p.x * p.x, &sine, &cosine);
    sincos_2pi(p.y, &s, &c);  // half a turn away
    const Vec3<F> m{sine * (s * ey_ - c * ex_), -sine * (c * ey_ + s * ex_), cosine};
    return m * (2.0f * dot(o_, m)) - o_;
  }

 private:
  static IntOf<F> head_of(const BsdfParams<F>& params, MaskOf<F> of_kind) {
    const F first = splat<F>(lane(params.p[0], std::countr_zero(mask_bits(of_kind))));
    return to_int(select(of_kind, params.p[0], first)) * kMeasuredUnit;
  }
  IntOf<F> integer(int slot) const { return as_int(float_bits(gather(tables_ + slot, head_))); }
  /// The viewer's azimuth in the turn that begins with the first one of the table.
  F azimuth() const {
    const F first = gather(tables_, integer(kMeasuredPhiAt)) * (0.5f * kInvPi), from = turn_ - first;
    return (first + (from - floor(from))) * (2 * kPi);
  }
  static F square_of_zenith(F turn) { return sqrt(4.0f * turn); }
  static F square_of_turn(F turn) { return turn + 0.5f - floor(turn + 0.5f); }
  /// Of a table that does not depend on the view.
  F flat(int slot, F x, F y) const {
    const IntOf<F> values = integer(slot + 2);
    return MeasuredCell<F>(integer(slot), integer(slot + 1), x, y).interpolate([&](IntOf<F> i) {
      return gather(tables_, values + i);
    });
  }
  Vec3<F> reflected(F u, F v) const {
    const IntOf<F> w = luminance_.width(), h = luminance_.height(), values = integer(kMeasuredRgbAt),
                   stride = w * h * 3;
    const MeasuredCell<F> cell(w, h, u, v);
    const auto channel = [&](int c) {
      return cell.interpolate(
          [&](IntOf<F> i) { return views_.blend(tables_, values + (i * 3 + c), stride); });
    };
    return {channel(0), channel(1), channel(2)};
  }

  const float* tables_;
  IntOf<F> head_;
  Vec3<F> o_;
  MaskOf<F> isotropic_;
  F sine_, turn_from_zenith_, turn_;
  MeasuredViews<F> views_;
  MeasuredWarp<F> visible_, luminance_;
  F ex_, ey_;  // where the azimuth of facets counts from
};

/// In the lobe's axes.
template <class F>
inline BsdfEval<F> eval_measured_lobe(const BsdfParams<F>& params, MaskOf<F> of_kind, Vec3<F> wo, Vec3<F> wi,
                                      Mode mode) {
  const MaskOf<F> reflects = mask_and(of_kind, same_side(wo, wi));
  // Seen from below, all is turned upside down.
  const F side = copysign(splat<F>(1.0f), wo.z);
  wo = wo * side;
  wi = {select(reflects, wi.x * side, F{}), select(reflects, wi.y * side, F{}),
        select(reflects, wi.z * side, splat<F>(1.0f))};
  Vec3<F> f;
  const bool radiance = mode == Mode::kRadiance;
  const F forward = MeasuredView<F>(params, of_kind, wo).eval(wi, radiance ? &f : nullptr);
  const Vec3<F> from{select(reflects, wo.x, F{}), select(reflects, wo.y, F{}),
                     select(reflects, wo.z, splat<F>(1.0f))};
  const F backward = MeasuredView<F>(params, of_kind, wi).eval(from, radiance ? nullptr : &f);
  const auto density = [&](F table, F cosine) {
    return select(reflects,
                  table * (1 - kMeasuredCosineShare) + max(cosine, F{}) * (kInvPi * kMeasuredCosineShare),
                  F{});
  };
  return {select(reflects, f, Vec3<F>{}), density(forward, wi.z), density(backward, from.z)};
}

template <class F>
[[gnu::noinline]] BsdfEval<F> eval_measured(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                                            const Vec3<F>& wi, Mode mode) {
  const LobeAxes<F> axes(params.p[9]);
  return eval_measured_lobe(params, of_kind, axes.to_lobe(wo), axes.to_lobe(wi), mode);
}

template <class F>
[[gnu::noinline]] BsdfSample<F> sample_measured(const BsdfParams<F>& params, MaskOf<F> of_kind,
                                                const Vec3<F>& wo, F u, F v, Mode mode) {
  const LobeAxes<F> axes(params.p[9]);
  const Vec3<F> o = axes.to_lobe(wo);
  const F side = copysign(splat<F>(1.0f), o.z);
  const MaskOf<F> by_cosine = choose_lobe(splat<F>(kMeasuredCosineShare), &u);
  const Vec3<F> i = select(by_cosine, square_to_cosine_hemisphere(u, v),
                           MeasuredView<F>(params, of_kind, o * side).sample(u, v)) *
                    side;
  const BsdfEval<F> e = eval_measured_lobe(params, of_kind, o, i, mode);
  BsdfSample<F> s;
  s.wi = axes.from_lobe(i);
  s.pdf = e.pdf;
  s.pdf_reverse = e.pdf_reverse;
  s.valid = MaskOf<F>(e.pdf > 0.0f);
  s.weight = e.f * (abs(i.z) / select(s.valid, e.pdf, splat<F>(1.0f)));
  s.delta = splat_mask<F>(false);
  return s;
}

}  // namespace lightmill
