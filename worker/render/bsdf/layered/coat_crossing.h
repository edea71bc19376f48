#pragma once
// Hits of the rough interface of a coat, drawn facet by facet: what the tables of the layered BSDFs are
// integrated over when a scene is built.
#include <algorithm>
#include <cmath>

#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/ggx.h"

namespace lightmill {

/// A coat: its index over air, optical thickness per unit cosine, roughness (at or below
/// kSmoothAlpha: smooth).
struct CoatDescription {
  float eta, thickness, alpha;
};

/// A facet seen from `w` (w.z > 0).
inline Vec3<float> coat_facet(float alpha, const Vec3<float>& w, float u, float v) {
  return alpha <= kSmoothAlpha ? Vec3<float>{0, 0, 1} : Ggx<float>{alpha}.sample_visible(w, u, v);
}
/// Weight of scattering at a sampled facet: what is not masked.
inline float coat_unmasked(float alpha, const Vec3<float>& from, const Vec3<float>& to) {
  if (alpha <= kSmoothAlpha) return 1;
  const Ggx<float> ggx{alpha};
  return ggx.g(from, to) / ggx.g1(from);
}

/// Both ways out of a facet of the coat, met from outside (eta) or from inside (1 / eta). Energies; a
/// direction that leaves on the wrong side has none.
struct CoatCrossing {
  Vec3<float> reflected, transmitted;
  float reflectance, transmittance;
};
inline CoatCrossing cross_coat(float alpha, float eta, const Vec3<float>& from, float u, float v) {
  const Vec3<float> m = coat_facet(alpha, from, u, v);
  const float c = dot(from, m);
  float cos_t;
  const float r = fresnel_dielectric(std::min(std::fabs(c), 1.0f), eta, &cos_t);
  CoatCrossing x;
  x.reflected = m * (2 * c) - from;
  x.transmitted = m * (c / eta - cos_t) - from * (1 / eta);
  x.reflectance = x.reflected.z > 0 ? r * coat_unmasked(alpha, from, x.reflected) : 0;
  x.transmittance = x.transmitted.z < 0 ? (1 - r) * coat_unmasked(alpha, from, x.transmitted) : 0;
  return x;
}

/// Direction of cosine `cosine` in the plane of x and z.
inline Vec3<float> coat_direction(float cosine) {
  return {std::sqrt(std::max(1 - cosine * cosine, 0.0f)), 0, cosine};
}

}  // namespace lightmill
