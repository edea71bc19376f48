#pragma once
// The distributions of facets that Blender's glossy lobes and glass may have, as Cycles 3.4 has them: masking
// and shadowing are apart, G = G1(wo) G1(wi) (Walter et al. 2007). A direction is drawn as if the facets were
// GGX's: the others have the same density of flat facets and shorter tails.
#include "worker/render/bsdf/ggx.h"
#include "worker/render/bsdf/tables/metallic_table.h"
#include "worker/render/math/exp.h"

namespace lightmill {

/// Distributions, in a parameter.
inline constexpr float kGgxFacets = 0, kBeckmannFacets = 1, kAshikhminShirleyFacets = 2, kMultiGgxFacets = 3;

/// What a lobe of GGX facets of reflectance `r` gets back of the light that single bounces lose, as a factor:
/// 1 + r (g g - 1), which keeps a white lobe white (metallic_table.h). In Cycles light walks over the facets.
template <class F>
inline Vec3<F> multiple_bounces(const float* tables, const Vec3<F>& r, F alpha, F co, F ci) {
  const F gain = LobeAlbedo<F>(tables, co, alpha).g * LobeAlbedo<F>(tables, ci, alpha).g - 1.0f;
  return {1.0f + r.x * gain, 1.0f + r.y * gain, 1.0f + r.z * gain};
}

template <class F>
struct BlenderFacets {
  AnisotropicGgx<F> ggx;
  F shape;

  MaskOf<F> is(float which) const { return MaskOf<F>(shape == which); }

  /// D(m) G1(wo) G1(wi), with several bounces D(m) G(wo, wi). Ashikhmin and Shirley's lobe (2000) has no such
  /// factors; it is norm cos^e / (<wo, m> max(cos wo, cos wi)), here times 4 cos wo cos wi.
  F density(const Vec3<F>& m, const Vec3<F>& wo, const Vec3<F>& wi) const {
    F value = ggx.d(m) * ggx.g1(wo) * ggx.g1(wi);
    const MaskOf<F> multiple = is(kMultiGgxFacets);
    if (any(multiple)) value = select(multiple, ggx.d(m) * ggx.g(wo, wi), value);
    const MaskOf<F> beckmann = is(kBeckmannFacets), ashikhmin = is(kAshikhminShirleyFacets);
    if (any(beckmann)) value = select(beckmann, beckmann_d(m) * beckmann_g1(wo) * beckmann_g1(wi), value);
    if (any(ashikhmin)) value = select(ashikhmin, ashikhmin_shirley(m, wo, wi), value);
    return value;
  }

 private:
  static F floor_z2(const Vec3<F>& w) { return max(w.z * w.z, splat<F>(1e-12f)); }
  F beckmann_d(const Vec3<F>& m) const {
    const F x = m.x / ggx.alpha_x, y = m.y / ggx.alpha_y, z2 = floor_z2(m);
    return exp_negative(-(x * x + y * y) / z2) * kInvPi / (ggx.alpha_x * ggx.alpha_y * z2 * z2);
  }
  /// Walter et al.'s rational fit.
  F beckmann_g1(const Vec3<F>& w) const {
    const F x = ggx.alpha_x * w.x, y = ggx.alpha_y * w.y;
    const F a2 = floor_z2(w) / max(x * x + y * y, splat<F>(1e-20f));
    const F a = sqrt(min(a2, splat<F>(4.0f)));
    const F fit = (3.535f * a + 2.181f * a * a) / (1.0f + 2.276f * a + 2.577f * a * a);
    return select(MaskOf<F>(a >= 1.6f), splat<F>(1.0f), fit);
  }
  F ashikhmin_shirley(const Vec3<F>& m, const Vec3<F>& wo, const Vec3<F>& wi) const {
    const auto exponent = [](F alpha) { return max(2.0f / (alpha * alpha) - 2.0f, F{}); };
    const F ex = exponent(ggx.alpha_x), ey = exponent(ggx.alpha_y);
    const F s2 = m.x * m.x + m.y * m.y, z2 = floor_z2(m);
    const F e = select(MaskOf<F>(s2 > 1e-12f), (ex * m.x * m.x + ey * m.y * m.y) / max(s2, splat<F>(1e-12f)),
                       0.5f * (ex + ey));
    const F lobe = exp_negative(0.5f * e * log_positive(min(z2, splat<F>(1.0f))));
    const F norm = sqrt((ex + 1.0f) * (ey + 1.0f)) * (0.5f * kInvPi);
    const F co = abs(wo.z), ci = abs(wi.z);
    return norm * lobe * min(co, ci) / max(abs(dot(wo, m)), splat<F>(1e-6f));
  }
};

}  // namespace lightmill
