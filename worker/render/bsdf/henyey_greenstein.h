#pragma once
// Henyey and Greenstein's phase function, as a BSDF whose frame has z = wo: so the propagation before the
// event is along -z, and scattering by angle theta leaves along wi with wi.z = -cos theta.
//   p = (1 - g^2) / (4 pi (1 + g^2 - 2 g cos theta)^(3/2))   per unit solid angle; it is its own density.
// Written with 1 - cos theta and (1 - g)^2, or 1 + cos theta and (1 + g)^2: with g near 1 or -1 the usual
// forms cancel.
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/math/trig.h"

namespace lightmill {

/// Slot 0 of the parameters is g. This one is for whoever joins vertices: the mean collision rate there.
inline constexpr int kPhaseRateSlot = 1;

template <class F>
inline F henyey_greenstein(F g, const Vec3<F>& wi) {
  // From the peak, which is backwards for g < 0: there by the sine, which is known better.
  const F z = select(MaskOf<F>(g < 0.0f), -wi.z, wi.z), peaked = abs(g);
  const F sine2 = wi.x * wi.x + wi.y * wi.y;
  const F off_peak = select(MaskOf<F>(z < 0.0f), sine2 / max(1.0f - z, splat<F>(1.0f)), 1.0f + z);
  const F d = sqr(1.0f - peaked) + 2.0f * peaked * off_peak;
  return (1.0f - g) * (1.0f + g) * (0.25f * kInvPi) / (d * sqrt(d));
}

template <class F>
inline BsdfEval<F> eval_henyey_greenstein(const BsdfParams<F>& params, const Vec3<F>& wi) {
  BsdfEval<F> e;
  e.pdf = e.pdf_reverse = henyey_greenstein(params.p[0], wi);
  e.f = splat3<F>(1, 1, 1) * e.pdf;
  return e;
}

/// Inverts the distribution of cos theta in both 1 - cos and 1 + cos, of which the sine is made:
///   D = 1 - g + 2 g u,  1 - cos = 2 (1 - g)^2 (1 - u) (1 + g u) / D^2,
///   1 + cos = 2 (1 + g)^2 u (1 - g (1 - u)) / D^2,
/// each as a sum of what is positive.
template <class F>
inline BsdfSample<F> sample_henyey_greenstein(const BsdfParams<F>& params, F u, F v) {
  const F g = params.p[0], rest = 1.0f - u;
  const F a = (1.0f - g) * rest, b = (1.0f + g) * u, d = 1.0f / (a + b);
  const F minus = 2.0f * (1.0f - g) * a * d * d * (rest + b);
  const F plus = 2.0f * (1.0f + g) * b * d * d * (u + a);
  F sp, cp;
  sincos_2pi(v, &sp, &cp);
  const F sine = sqrt(minus * plus);
  BsdfSample<F> s;
  // From the smaller of the two.
  const F cosine = select(MaskOf<F>(minus < plus), 1.0f - minus, plus - 1.0f);
  s.wi = {sine * cp, sine * sp, -cosine};
  s.weight = splat3<F>(1, 1, 1);
  s.pdf = s.pdf_reverse = henyey_greenstein(g, s.wi);
  s.valid = splat_mask<F>(true);
  s.delta = splat_mask<F>(false);
  return s;
}

}  // namespace lightmill
