#pragma once
// Reflectance of a surface under a film so thin that light reflected at both of its sides interferes (glTF's
// KHR_materials_iridescence).
//
// Belcour and Barla, "A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence",
// 2017, with what the extension takes for the parts: Schlick's Fresnel terms at both interfaces, a base of
// the real index that reflects f0 in air, and the two first orders of interference. An order of optical path
// difference D weighs a channel by S(D), the Fourier transform of its sensitivity, of which the paper gives
// Gaussian fits for XYZ (its supplemental code); taken to Rec.709 here and scaled to S(0) = 1, so that a film
// of no thickness changes no colour. Phases are shifted by half a turn where light meets a larger index, per
// channel. The result is clamped to [0, 1], which neither the fits nor a cut series keep to.
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/math/exp.h"
#include "worker/render/math/trig.h"

namespace lightmill {

namespace thin_film_detail {
/// Turns per nm and decay per nm^2 of the fits, and what each weighs in R, G and B.
inline constexpr int kFits = 4;
inline constexpr float kTurns[kFits] = {1.6810e-3f, 1.7953e-3f, 2.2084e-3f, 2.2399e-3f};
inline constexpr float kDecay[kFits] = {1.708547e-7f, 3.673309e-7f, 2.610352e-7f, 1.787662e-7f};
inline constexpr float kWeight[3][kFits] = {{2.275931f, -1.275526f, -0.4140567f, 0.413652f},
                                            {-0.8652895f, 1.978687f, 0.04386986f, -0.157267f},
                                            {0.05176555f, -0.2242517f, 1.163078f, 0.009408423f}};

/// S at a path difference >= 0 in nm.
template <class F>
inline Vec3<F> sensitivity(F path) {
  Vec3<F> s{};
  for (int i = 0; i < kFits; ++i) {
    const F turns = path * kTurns[i];
    F sine, cosine;
    sincos_2pi(turns - floor(turns), &sine, &cosine);
    const F wave = exp_negative(path * path * -kDecay[i]) * cosine;
    s = s + Vec3<F>{wave * kWeight[0][i], wave * kWeight[1][i], wave * kWeight[2][i]};
  }
  return s;
}
}  // namespace thin_film_detail

template <class F>
class ThinFilm {
 public:
  /// Met from air at `cosine` in [0, 1]; index `ior` >= 1, `thickness` in nm.
  ThinFilm(F cosine, F ior, F thickness) : ior_(ior) {
    const F root = (ior - 1.0f) / (ior + 1.0f);
    const F r0 = root * root;
    outer_ = r0 + (1.0f - r0) * schlick_weight(cosine);
    const F inside = safe_sqrt(1.0f - max(1.0f - cosine * cosine, F{}) / (ior * ior));
    schlick_inside_ = schlick_weight(inside);
    const F path = 2.0f * ior * thickness * inside;
    first_ = thin_film_detail::sensitivity(path);
    second_ = thin_film_detail::sensitivity(path + path);
  }

  /// Of film and base together, per channel; `f0` is the base's reflectance in air at normal incidence.
  Vec3<F> reflectance(const Vec3<F>& f0) const {
    return {channel(f0.x, first_.x, second_.x), channel(f0.y, first_.y, second_.y),
            channel(f0.z, first_.z, second_.z)};
  }

 private:
  F channel(F f0, F s1, F s2) const {
    const F root = sqrt(clamp(f0, 0.0f, 0.9999f));
    const F base = (1.0f + root) / (1.0f - root);
    const F edge = (base - ior_) / (base + ior_);
    const F r0 = edge * edge;
    const F inner = r0 + (1.0f - r0) * schlick_inside_;
    const F through = 1.0f - outer_;
    const F both = min(outer_ * inner, splat<F>(0.9999f)), amplitude = sqrt(both);
    const F mean = through * through * inner / (1.0f - both);
    // Inside, light is turned by half a wave where the base is the thinner of the two; at the outer side back
    // again, and not where it is reflected from outside.
    const F order1 = select(MaskOf<F>(base < ior_), s1, -s1);
    const F waves = 2.0f * (mean - through) * amplitude * (order1 + amplitude * s2);
    return clamp(outer_ + mean + waves, 0.0f, 1.0f);
  }

  F ior_, outer_, schlick_inside_;
  Vec3<F> first_, second_;
};

}  // namespace lightmill
