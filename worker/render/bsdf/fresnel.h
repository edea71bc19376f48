#pragma once
// Fresnel reflectance of unpolarised light.
#include "worker/render/math/vec.h"

namespace lightmill {

/// Smooth dielectric interface. `cos_i` in [0, 1] on the incident side; `eta` = n_transmitted / n_incident.
/// Returns the reflectance and sets cos_t (0 under total internal reflection, where the result is 1).
template <class F>
inline F fresnel_dielectric(F cos_i, F eta, F* cos_t) {
  const F sin2_t = max(1.0f - cos_i * cos_i, F{}) / (eta * eta);
  const MaskOf<F> total = MaskOf<F>(sin2_t >= 1.0f);
  *cos_t = safe_sqrt(1.0f - sin2_t);
  const F parallel = (eta * cos_i - *cos_t) / (eta * cos_i + *cos_t);
  const F perpendicular = (cos_i - eta * *cos_t) / (cos_i + eta * *cos_t);
  const F r = 0.5f * (parallel * parallel + perpendicular * perpendicular);
  return select(total, splat<F>(1.0f), r);
}

/// One channel of a conductor with complex index eta + i k against air (exact form).
template <class F>
inline F fresnel_conductor(F cos_i, F eta, F k) {
  const F c2 = cos_i * cos_i;
  const F s2 = max(1.0f - c2, F{});
  const F eta2 = eta * eta, k2 = k * k;
  const F t0 = eta2 - k2 - s2;
  const F a2_plus_b2 = safe_sqrt(t0 * t0 + 4.0f * eta2 * k2);
  const F a = safe_sqrt(0.5f * (a2_plus_b2 + t0));
  const F t1 = a2_plus_b2 + c2;
  const F t2 = 2.0f * cos_i * a;
  const F rs = (t1 - t2) / (t1 + t2);
  const F t3 = c2 * a2_plus_b2 + s2 * s2;
  const F t4 = t2 * s2;
  const F rp = rs * (t3 - t4) / (t3 + t4);
  return 0.5f * (rp + rs);
}

/// (1 - cosine)^5 of Schlick's approximation F = f0 + (f90 - f0) (1 - cosine)^5.
template <class F>
inline F schlick_weight(F cosine) {
  const F x = clamp(1.0f - cosine, 0.0f, 1.0f), x2 = x * x;
  return x2 * x2 * x;
}

/// Cosine at which a rough surface (GGX alpha) is met on the average along `w`: mean of <w, m> over its
/// facets, |cos w| (1 + Lambda). F at it is the reflectance to first order.
template <class F>
inline F facet_cosine(const Vec3<F>& w, F alpha) {
  const F z = abs(w.z);
  return min(0.5f * (z + sqrt(z * z + alpha * alpha * (w.x * w.x + w.y * w.y))), splat<F>(1.0f));
}

template <class F>
inline Vec3<F> fresnel_conductor(F cos_i, const Vec3<F>& eta, const Vec3<F>& k) {
  return {fresnel_conductor(cos_i, eta.x, k.x), fresnel_conductor(cos_i, eta.y, k.y),
          fresnel_conductor(cos_i, eta.z, k.z)};
}

}  // namespace lightmill
