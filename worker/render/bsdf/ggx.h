#pragma once
// Isotropic GGX (Trowbridge-Reitz) microfacets. Shapes of the formulas: Walter et al. 2007; visible-normal
// sampling by spherical caps, Dupuy & Benyoub 2023. The tan^2 form is kept free of divisions by cos and of
// the cancellation in cos^2 (alpha^2 - 1) + 1.
//
// Where facets only reflect, those that would reflect below the surface are mostly left out: Eto & Tokuyoshi,
// "Bounded VNDF Sampling for Smith-GGX Reflections", 2023.
#include "worker/render/math/trig.h"
#include "worker/render/math/vec.h"

namespace lightmill {

/// The smallest cap of the hemisphere of facets (by its k) that holds all which reflect wo above the surface,
/// where `alpha` is the smaller roughness.
template <class F>
inline F reflection_cap(const Vec3<F>& wo, F alpha) {
  const F a2 = alpha * alpha, s = 1.0f + sqrt(wo.x * wo.x + wo.y * wo.y), s2 = s * s;
  return (1.0f - a2) * s2 / (s2 + a2 * wo.z * wo.z);
}

/// A visible facet of a cap (k of reflection_cap; 1: all), wo.z >= 0.
template <class F>
inline Vec3<F> sample_cap(const Vec3<F>& wo, F alpha_x, F alpha_y, F cap, F u, F v) {
  // In coordinates in which the surface is a hemisphere.
  const Vec3<F> wh = normalize(Vec3<F>{alpha_x * wo.x, alpha_y * wo.y, wo.z});
  F s, c;
  sincos_2pi(u, &s, &c);
  const F lowest = cap * wh.z;
  const F z = (1.0f - v) * (1.0f + lowest) - lowest;
  const F r = safe_sqrt(1.0f - z * z);
  const Vec3<F> h = Vec3<F>{r * c, r * s, z} + wh;
  return normalize(Vec3<F>{alpha_x * h.x, alpha_y * h.y, max(h.z, splat<F>(1e-12f))});
}

template <class F>
struct Ggx {
  F alpha;

  /// Density of normals, 1/sr: 1 / (pi a^2 (x^2/a^2 + y^2/a^2 + z^2)^2).
  F d(const Vec3<F>& m) const {
    const F a2 = alpha * alpha;
    const F e = (m.x * m.x + m.y * m.y) / a2 + m.z * m.z;
    return kInvPi / (a2 * e * e);
  }
  /// Smith Lambda.
  F lambda(const Vec3<F>& w) const {
    const F z2 = max(w.z * w.z, splat<F>(1e-30f));
    const F a = alpha * alpha * (w.x * w.x + w.y * w.y) / z2;
    return 0.5f * (sqrt(1.0f + a) - 1.0f);
  }
  F g1(const Vec3<F>& w) const { return 1.0f / (1.0f + lambda(w)); }
  /// Height-correlated masking and shadowing.
  F g(const Vec3<F>& wo, const Vec3<F>& wi) const { return 1.0f / (1.0f + lambda(wo) + lambda(wi)); }
  /// Density of visible normals seen from wo, 1/sr.
  F d_visible(const Vec3<F>& wo, const Vec3<F>& m) const {
    return g1(wo) * d(m) * abs(dot(wo, m)) / max(abs(wo.z), splat<F>(1e-12f));
  }
  /// Samples d_visible for wo with wo.z >= 0.
  Vec3<F> sample_visible(const Vec3<F>& wo, F u, F v) const {
    return sample_cap(wo, alpha, alpha, splat<F>(1.0f), u, v);
  }
  /// Samples facets that reflect wo, wo.z >= 0: the direction has the density d(m) * reflection_density(wo).
  Vec3<F> sample_reflecting(const Vec3<F>& wo, F u, F v) const {
    return sample_cap(wo, alpha, alpha, reflection_cap(wo, alpha), u, v);
  }
  F reflection_density(const Vec3<F>& wo) const {
    const F z = abs(wo.z), a2 = alpha * alpha;
    return 0.5f / max(reflection_cap(wo, alpha) * z + sqrt(a2 * (wo.x * wo.x + wo.y * wo.y) + z * z),
                      splat<F>(1e-12f));
  }
};

/// The same with a roughness for each tangent direction; the interface is Ggx's.
template <class F>
struct AnisotropicGgx {
  F alpha_x, alpha_y;

  F d(const Vec3<F>& m) const {
    const F x = m.x / alpha_x, y = m.y / alpha_y;
    const F e = x * x + y * y + m.z * m.z;
    return kInvPi / (alpha_x * alpha_y * e * e);
  }
  F lambda(const Vec3<F>& w) const {
    const F z2 = max(w.z * w.z, splat<F>(1e-30f));
    const F x = alpha_x * w.x, y = alpha_y * w.y;
    return 0.5f * (sqrt(1.0f + (x * x + y * y) / z2) - 1.0f);
  }
  F g1(const Vec3<F>& w) const { return 1.0f / (1.0f + lambda(w)); }
  F g(const Vec3<F>& wo, const Vec3<F>& wi) const { return 1.0f / (1.0f + lambda(wo) + lambda(wi)); }
  Vec3<F> sample_visible(const Vec3<F>& wo, F u, F v) const {
    return sample_cap(wo, alpha_x, alpha_y, splat<F>(1.0f), u, v);
  }
  Vec3<F> sample_reflecting(const Vec3<F>& wo, F u, F v) const {
    return sample_cap(wo, alpha_x, alpha_y, reflection_cap(wo, min(alpha_x, alpha_y)), u, v);
  }
  F reflection_density(const Vec3<F>& wo) const {
    const F z = abs(wo.z), x = alpha_x * wo.x, y = alpha_y * wo.y;
    return 0.5f /
           max(reflection_cap(wo, min(alpha_x, alpha_y)) * z + sqrt(x * x + y * y + z * z), splat<F>(1e-12f));
  }
};

/// Lanes of a round distribution among others.
template <class F>
inline Ggx<F> select(MaskOf<F> m, const Ggx<F>& a, const Ggx<F>& b) {
  return {select(m, a.alpha, b.alpha)};
}
template <class F>
inline AnisotropicGgx<F> select(MaskOf<F> m, const Ggx<F>& a, const AnisotropicGgx<F>& b) {
  return {select(m, a.alpha, b.alpha_x), select(m, a.alpha, b.alpha_y)};
}

/// Axes of an anisotropic lobe within the shading frame, from a rotation in turns.
template <class F>
struct LobeAxes {
  F c, s;
  explicit LobeAxes(F rotation) { sincos_2pi(rotation, &s, &c); }
  Vec3<F> to_lobe(const Vec3<F>& w) const { return {w.x * c + w.y * s, w.y * c - w.x * s, w.z}; }
  Vec3<F> from_lobe(const Vec3<F>& w) const { return {w.x * c - w.y * s, w.y * c + w.x * s, w.z}; }
};

}  // namespace lightmill
