#pragma once
// The lobe of fibres that stand on a surface: see sheen_table.h.
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/packed_params.h"
#include "worker/render/bsdf/tables/sheen_table.h"
#include "worker/render/math/exp.h"
#include "worker/render/math/trig.h"

namespace lightmill {

template <class F>
struct Charlie {
  F alpha;

  explicit Charlie(F roughness) {
    const F r = max(roughness, splat<F>(kLeastSheenRoughness));
    alpha = r * r;
  }
  /// Density of fibres' normals, 1/sr: (2 + 1/a) sin^(1/a) / (2 pi).
  F d(const Vec3<F>& m) const {
    const F sine2 = min(m.x * m.x + m.y * m.y, splat<F>(1.0f));
    const F inverse = 1.0f / alpha;
    const F power = exp_negative(log_positive(max(sine2, splat<F>(1e-30f))) * (0.5f * inverse));
    return (2.0f + inverse) * power * (0.5f * kInvPi);
  }
  /// Fit of the masking Lambda at a cosine in (0, 1].
  F lambda(F cosine) const {
    const MaskOf<F> grazing = MaskOf<F>(cosine < 0.5f);
    const F exponent = select(grazing, fit(cosine), 2.0f * fit(splat<F>(0.5f)) - fit(1.0f - cosine));
    // e^x = e^-|x| or its reciprocal.
    const F e = exp_negative(-abs(exponent));
    return select(MaskOf<F>(exponent > 0.0f), 1.0f / e, e);
  }
  /// D V, 1/sr.
  F value(const Vec3<F>& m, F co, F ci) const {
    return d(m) / ((1.0f + lambda(co) + lambda(ci)) * (4.0f * co * ci));
  }

 private:
  F fit(F x) const {
    const F t = (1.0f - alpha) * (1.0f - alpha);
    const auto between = [&](float smooth, float rough) { return rough + (smooth - rough) * t; };
    const F a = between(25.3245f, 21.5473f), b = between(3.32435f, 3.82987f), c = between(0.16801f, 0.19823f),
            d = between(-1.27393f, -1.97760f), e = between(-4.85967f, -4.32054f);
    const F power = exp_negative(log_positive(max(x, splat<F>(1e-30f))) * c);  // x^c, x <= 1
    return a / (1.0f + b * power) + d * x + e;
  }
};

/// Sheen's parameters among those of metallic_roughness.h: 6 holds whole steps of the sheen's roughness
/// beside alpha, 7 f90 and the dielectric's largest f0, 8 the colour.
inline constexpr float kSheenSteps = 1024;
inline float sheen_alpha_slot(float sheen_roughness, float alpha) {
  return static_cast<float>(static_cast<int>(sheen_roughness * kSheenSteps + 0.5f)) + alpha;
}

/// What `params` says of the sheen; `base` receives the parameters of what is below.
template <class F>
struct SheenParams {
  F roughness;
  Vec3<F> color;
  BsdfParams<F> base;

  SheenParams(const BsdfParams<F>& params, MaskOf<F> of_kind) : base(params) {
    const UnpackedSteps<F> rough(params.p[6], of_kind);
    roughness = rough.steps * (1 / kSheenSteps);
    base.p[6] = rough.fraction;
    const UnpackedPair<F> pair(params.p[7], of_kind);
    base.p[7] = pair.first;
    base.p[8] = pair.second;
    color = unpacked_color(params.p[8], of_kind);
  }
};

}  // namespace lightmill
