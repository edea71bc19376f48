#include "worker/render/bsdf/layered/coated_diffuse.h"

#include <algorithm>
#include <cmath>

#include "worker/render/bsdf/layered/layered_walk.h"

namespace lightmill {
namespace {

/// Reflectance from outside at cosine mu; the refracted cosine to *cos_t.
double reflectance(double mu, double eta, double* cos_t) {
  const double sin2_t = (1 - mu * mu) / (eta * eta);
  *cos_t = std::sqrt(std::max(0.0, 1 - sin2_t));
  if (sin2_t >= 1) return 1;
  const double parallel = (eta * mu - *cos_t) / (eta * mu + *cos_t);
  const double perpendicular = (mu - eta * *cos_t) / (mu + eta * *cos_t);
  return 0.5 * (parallel * parallel + perpendicular * perpendicular);
}

}  // namespace

CoatConstants coat_constants(double eta, double thickness) {
  constexpr int kSteps = 8192;
  CoatConstants c{0, 0};
  for (int i = 0; i < kSteps; ++i) {
    const double mu = (i + 0.5) / kSteps, w = 2 * mu / kSteps;
    double cos_t;
    const double outside = reflectance(mu, eta, &cos_t);
    if (cos_t > 0) c.entering_transmittance += w * (1 - outside) * std::exp(-thickness / cos_t);
    double unused;
    const double inside = reflectance(mu, 1 / eta, &unused);
    c.internal_reflectance += w * inside * std::exp(-2 * thickness / mu);
  }
  return c;
}

// pbrt-v4 estimates the same integrals by two strategies, and weighs them by densities of different measures:
// the base's over directions in the coat, the coat's over those outside. The weights sum to more than 1, and
// its rough coats over a diffuse base are brighter by 5 % (alpha 0.3). With both densities over directions in
// the coat its renders and these agree within 1 % in every region.
CoatConstants rough_coat_constants(float eta, float thickness, float alpha, CosineRow* row) {
  const CoatDescription coat{eta, thickness, alpha};
  CoatConstants c{coat_internal_return(coat), 0};
  std::array<double, kCosineNodes> entering;
  for (int i = 0; i < kCosineNodes; ++i) {
    const float cosine = node_cosine(i);
    const Vec3<float> w{std::sqrt(std::max(1 - cosine * cosine, 0.0f)), 0, cosine};
    double cos_t;
    const double smooth =
        (1 - reflectance(facet_cosine(w, alpha), eta, &cos_t)) * std::exp(-thickness / std::max(cos_t, 1e-6));
    const auto n = static_cast<size_t>(i);
    entering[n] = coat_entering(coat, cosine);
    (*row)[n] = smooth > 0 ? static_cast<float>(entering[n] / smooth) : 0.0f;
  }
  // 2 int T mu dmu over the linear pieces between the nodes, by Simpson's rule (exact for them).
  for (size_t i = 0; i + 1 < kCosineNodes; ++i) {
    const double h = 1.0 / (kCosineNodes - 1), a = static_cast<double>(i) * h, b = a + h;
    const double middle = 0.5 * (entering[i] + entering[i + 1]) * 0.5 * (a + b);
    c.entering_transmittance += 2 * h / 6 * (entering[i] * a + 4 * middle + entering[i + 1] * b);
  }
  return c;
}

float coated_base(float rho, double eta, double internal_reflectance, int base_encounters) {
  const double x = rho * internal_reflectance;
  const double series = (1 - std::pow(x, base_encounters)) / (1 - x);
  return static_cast<float>(rho * series / (M_PI * eta * eta));
}

}  // namespace lightmill
