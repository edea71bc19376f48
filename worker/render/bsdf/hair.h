#pragma once
// Fibres: Chiang et al., "A Practical and Controllable Hair and Fur Model" (2016), as pbrt-v4 has it;
// factors:
//   f |cos wi| = sum over p of M_p(theta) A_p N_p(phi)
// for light that is reflected (p = 0), goes through (1), is reflected once inside (2), and the rest (3). M is
// d'Eon's energy-conserving lobe, N a logistic lobe around the direction of a smooth fibre, A what is left by
// Fresnel and absorption. The fibre runs along x of the lobe's axes.
//
// Parameters: 0-2 sigma_a (per radius), 3 variance of M_0, 4 scale of N, 5 sine of the scales' tilt, 6 eta,
// 8 offset h of the hit from the axis, in (-1, 1) (fibre.h), 9 rotation of the fibre.
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/ggx.h"
#include "worker/render/math/angle.h"
#include "worker/render/math/exp.h"

namespace lightmill {

/// e^-x I_0(x) for x >= 0 (Abramowitz & Stegun 9.8.1 and 9.8.2).
template <class F>
inline F scaled_bessel_i0(F x) {
  const F t = min(x, splat<F>(3.75f)) * (1 / 3.75f), t2 = t * t;
  F p = splat<F>(0.0045813f);
  for (const float c : {0.0360768f, 0.2659732f, 1.2067492f, 3.0899424f, 3.5156229f, 1.0f}) p = p * t2 + c;
  const F large = max(x, splat<F>(3.75f)), r = 3.75f / large;
  F q = splat<F>(0.00392377f);
  for (const float c : {-0.01647633f, 0.02635537f, -0.02057706f, 0.00916281f, -0.00157565f, 0.00225319f,
                        0.01328592f, 0.39894228f})
    q = q * r + c;
  return select(MaskOf<F>(x < 3.75f), p * exp_negative(-x), q / sqrt(large));
}

/// Angle of (x, y) in (-pi, pi].
template <class F>
inline F signed_angle(F y, F x) {
  const F t = turns(y, x);
  return select(MaskOf<F>(t > 0.5f), t - 1.0f, t) * (2 * kPi);
}

/// Everything about the side that `w` is on.
template <class F>
struct HairSide {
  static constexpr int kLobes = 4;
  F sin_theta, cos_theta, phi, gamma_o, gamma_t, scale, inv_range;
  F tilted_sin[3], tilted_cos[3];
  F variance[3];
  Vec3<F> attenuation[kLobes];
  F share[kLobes];  // of the lobes in sampling

  HairSide(const BsdfParams<F>& params, const Vec3<F>& w) {
    const F h = clamp(params.p[8], -0.9999f, 0.9999f), eta = params.p[6];
    sin_theta = clamp(w.x, -0.99999f, 0.99999f);
    cos_theta = sqrt(1.0f - sin_theta * sin_theta);
    phi = signed_angle(w.z, w.y);
    const F cos_gamma_o = sqrt(1.0f - h * h);
    gamma_o = signed_angle(h, cos_gamma_o);
    // Refracted: Bravais' index for the plane across the fibre.
    const F sin_theta_t = sin_theta / eta, cos_theta_t = safe_sqrt(1.0f - sin_theta_t * sin_theta_t);
    const F etap = safe_sqrt(eta * eta - sin_theta * sin_theta) / cos_theta;
    const F sin_gamma_t = clamp(h / max(etap, splat<F>(1e-3f)), -1.0f, 1.0f);
    const F cos_gamma_t = safe_sqrt(1.0f - sin_gamma_t * sin_gamma_t);
    gamma_t = signed_angle(sin_gamma_t, cos_gamma_t);
    const F path = -2.0f * cos_gamma_t / max(cos_theta_t, splat<F>(1e-3f));
    const Vec3<F> t{exp_negative(params.p[0] * path), exp_negative(params.p[1] * path),
                    exp_negative(params.p[2] * path)};
    F cos_inside;
    const F f = fresnel_dielectric<F>(cos_theta * cos_gamma_o, eta, &cos_inside);
    attenuation[0] = {f, f, f};
    attenuation[1] = t * sqr(1.0f - f);
    attenuation[2] = attenuation[1] * t * f;
    const auto rest = [&](F last, F through) {
      return last * (f * through / max(1.0f - through * f, splat<F>(1e-6f)));
    };
    attenuation[3] = {rest(attenuation[2].x, t.x), rest(attenuation[2].y, t.y), rest(attenuation[2].z, t.z)};
    F sum{};
    for (int p = 0; p < kLobes; ++p) {
      share[p] = attenuation[p].x + attenuation[p].y + attenuation[p].z;
      sum = sum + share[p];
    }
    const F inv_sum = 1.0f / max(sum, splat<F>(1e-20f));
    for (F& s : share) s = s * inv_sum;
    // Scales tilt reflection by 2 alpha, light that goes through by -alpha, and the third lobe by -4 alpha.
    const F s1 = params.p[5], c1 = safe_sqrt(1.0f - s1 * s1);
    const F s2 = 2.0f * s1 * c1, c2 = c1 * c1 - s1 * s1, s4 = 2.0f * s2 * c2, c4 = c2 * c2 - s2 * s2;
    const F sines[3] = {-s2, s1, s4}, cosines[3] = {c2, c1, c4};
    for (int p = 0; p < 3; ++p) {
      tilted_sin[p] = sin_theta * cosines[p] + cos_theta * sines[p];
      tilted_cos[p] = abs(cos_theta * cosines[p] - sin_theta * sines[p]);
    }
    variance[0] = params.p[3];
    variance[1] = 0.25f * params.p[3];
    variance[2] = 4.0f * params.p[3];
    scale = params.p[4];
    const F e = exp_negative(-kPi / scale);
    inv_range = (1.0f + e) / (1.0f - e);
  }

  F lobe_sin(int p) const { return p < 3 ? tilted_sin[p] : sin_theta; }
  F lobe_cos(int p) const { return p < 3 ? tilted_cos[p] : cos_theta; }
  F lobe_variance(int p) const { return variance[p < 3 ? p : 2]; }

  /// M_p, per unit of the sine: normalised over directions with N_p.
  F longitudinal(int p, F sin_i, F cos_i) const {
    const F v = lobe_variance(p), s = lobe_sin(p), c = lobe_cos(p);
    // e^-b I0(a) / (2 v sinh(1/v)) with a = cos cos / v, b = sin sin / v.
    const F cosine = cos_i * c - sin_i * s, sine = sin_i * c + cos_i * s;
    const F one_minus =
        select(MaskOf<F>(cosine > 0.0f), sine * sine / (1.0f + max(cosine, F{})), 1.0f - cosine);
    return scaled_bessel_i0(cos_i * c / v) * exp_negative(-one_minus / v) /
           (v * (1.0f - exp_negative(-2.0f / v)));
  }
  F exit_angle(int p) const {
    return static_cast<float>(2 * p) * gamma_t - 2.0f * gamma_o + static_cast<float>(p) * kPi;
  }
  /// N_p at the difference of azimuths.
  F azimuthal(int p, F difference) const {
    if (p == 3) return splat<F>(0.5f * kInvPi);
    F d = difference - exit_angle(p);
    d = abs(d - 2 * kPi * floor((d + kPi) * (0.5f * kInvPi)));
    const F e = exp_negative(-d / scale);
    return e / (scale * sqr(1.0f + e)) * inv_range;
  }
  /// f |cos wi| and the density of wi.
  Vec3<F> scattered(const Vec3<F>& wi, F* density) const {
    const F sin_i = clamp(wi.x, -0.99999f, 0.99999f), cos_i = sqrt(1.0f - sin_i * sin_i);
    const F difference = signed_angle(wi.z, wi.y) - phi;
    Vec3<F> sum{};
    *density = F{};
    for (int p = 0; p < kLobes; ++p) {
      const F lobe = longitudinal(p, sin_i, cos_i) * azimuthal(p, difference);
      sum = sum + attenuation[p] * lobe;
      *density = *density + share[p] * lobe;
    }
    return sum;
  }
};

/// Cosines by which f |cos| is divided stay above this, so that f is finite.
inline constexpr float kLeastHairCosine = 1e-6f;

template <class F>
inline BsdfEval<F> eval_hair(const BsdfParams<F>& params, const Vec3<F>& wo, const Vec3<F>& wi, Mode mode) {
  const LobeAxes<F> axes(params.p[9]);
  const Vec3<F> o = axes.to_lobe(wo), i = axes.to_lobe(wi);
  BsdfEval<F> e;
  const Vec3<F> s = HairSide<F>(params, o).scattered(i, &e.pdf);
  HairSide<F>(params, i).scattered(o, &e.pdf_reverse);
  // It is the light's side whose cosine is left out: f of light paths is that of camera paths.
  const F cosine = abs(mode == Mode::kRadiance ? i.z : o.z);
  e.f = s * (1.0f / max(cosine, splat<F>(kLeastHairCosine)));
  return e;
}

template <class F>
inline BsdfSample<F> sample_hair(const BsdfParams<F>& params, const Vec3<F>& wo, F lobe, F u, F v,
                                 Mode mode) {
  const LobeAxes<F> axes(params.p[9]);
  const Vec3<F> o = axes.to_lobe(wo);
  const HairSide<F> side(params, o);
  // One lobe by its share, and what is left of the number for the azimuth.
  F chosen_sin = side.lobe_sin(3), chosen_cos = side.lobe_cos(3), variance = side.lobe_variance(3), exit{};
  F below{}, rest = lobe;
  MaskOf<F> found = splat_mask<F>(false);
  for (int p = 0; p < 4; ++p) {
    const F share = side.share[p];
    const MaskOf<F> here = mask_and(mask_not(found), MaskOf<F>(lobe < below + share));
    rest = select(here, (lobe - below) / select(MaskOf<F>(share > 0.0f), share, splat<F>(1.0f)), rest);
    if (p < 3) {
      chosen_sin = select(here, side.lobe_sin(p), chosen_sin);
      chosen_cos = select(here, side.lobe_cos(p), chosen_cos);
      variance = select(here, side.lobe_variance(p), variance);
      exit = select(here, side.exit_angle(p), exit);
    }
    const MaskOf<F> uniform = splat_mask<F>(p == 3);
    found = mask_or(found, mask_and(here, mask_not(uniform)));
    below = below + share;
  }
  rest = clamp(rest, 0.0f, 1.0f - 0x1p-24f);
  // d'Eon et al. 2013, sec. 5: the cosine to the mirrored direction, and a turn around it.
  const F span = 1.0f - exp_negative(-2.0f / variance);
  const F cosine = clamp(1.0f + variance * log_positive(max(1.0f - u * span, splat<F>(1e-30f))), -1.0f, 1.0f);
  F turn_sin, turn_cos;
  sincos_2pi(v, &turn_sin, &turn_cos);
  const F sin_i = clamp(-cosine * chosen_sin + safe_sqrt(1.0f - cosine * cosine) * turn_cos * chosen_cos,
                        -0.99999f, 0.99999f);
  const F cos_i = sqrt(1.0f - sin_i * sin_i);
  // The logistic within [-pi, pi], by its inverse; the last lobe is uniform.
  const F e = exp_negative(-kPi / side.scale);
  const F low = e / (1.0f + e), cdf = low + rest * (1.0f - 2.0f * low);
  const F logistic = clamp(side.scale * (log_positive(max(cdf, splat<F>(1e-30f))) -
                                         log_positive(max(1.0f - cdf, splat<F>(1e-30f)))),
                           -kPi, kPi);
  const F around = select(found, exit + logistic, (2.0f * rest - 1.0f) * kPi);
  F t = (side.phi + around) * (0.5f * kInvPi);
  t = t - floor(t);
  F sine, cosine_phi;
  sincos_2pi(clamp(t, 0.0f, 1.0f), &sine, &cosine_phi);
  const Vec3<F> i{sin_i, cos_i * cosine_phi, cos_i * sine};
  BsdfSample<F> s;
  const Vec3<F> scattered = side.scattered(i, &s.pdf);
  HairSide<F>(params, i).scattered(o, &s.pdf_reverse);
  s.wi = axes.from_lobe(i);
  s.valid = mask_and(MaskOf<F>(s.pdf > 0.0f), MaskOf<F>(i.z != 0.0f));
  F scale = 1.0f / select(s.valid, s.pdf, splat<F>(1.0f));
  if (mode == Mode::kImportance) scale = scale * (abs(i.z) / max(abs(o.z), splat<F>(kLeastHairCosine)));
  s.weight = scattered * scale;
  s.delta = splat_mask<F>(false);
  return s;
}

}  // namespace lightmill
