#include "worker/render/bsdf/coated_diffuse.h"

#include <algorithm>
#include <cmath>

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

float coated_base(float rho, double eta, double internal_reflectance, int base_encounters) {
  const double x = rho * internal_reflectance;
  const double series = (1 - std::pow(x, base_encounters)) / (1 - x);
  return static_cast<float>(rho * series / (M_PI * eta * eta));
}

}  // namespace lightmill
