#include "worker/render/scene/geometry/hair_builder.h"

#include <algorithm>
#include <cmath>

#include "worker/render/math/exp.h"

namespace lightmill {
namespace {

double power(double x, int n) {
  double p = 1;
  for (int i = 0; i < n; ++i) p *= x;
  return p;
}

}  // namespace

void set_hair_colour(const MaterialEntry& entry, const Rgb& colour, float* params) {
  const float in[3] = {colour.r, colour.g, colour.b};
  for (int c = 0; c < 3; ++c) {
    if (entry.hair_reflectance) {
      // Chiang et al. 2016, eq. 9.
      const float log = log_positive(std::clamp(in[c], 1e-6f, 1.0f)) * entry.scale;
      params[c] = log * log;
    } else {
      params[c] = std::isfinite(in[c]) ? std::clamp(in[c], 0.0f, 1e8f) : 0.0f;
    }
  }
}

void build_hair(const HairMaterial& hair, MaterialEntry* entry, float* params) {
  entry->kind = kHair;
  const double m = double{hair.beta_m}, n = double{hair.beta_n};
  entry->hair_reflectance = hair.reflectance.has_value();
  entry->scale = static_cast<float>(1 / (5.969 - 0.215 * n + 2.532 * n * n - 10.73 * power(n, 3) +
                                         5.574 * power(n, 4) + 0.245 * power(n, 5)));
  const SpectrumInput& colour = hair.reflectance ? *hair.reflectance : hair.sigma_a;
  entry->texture_color = colour.texture;
  set_hair_colour(*entry, colour.value, params);
  // Chiang et al. 2016, eqs. 7 and 8.
  params[3] = static_cast<float>(power(0.726 * m + 0.812 * m * m + 3.7 * power(m, 20), 2));
  params[4] = static_cast<float>(std::sqrt(M_PI / 8) * (0.265 * n + 1.194 * n * n + 5.372 * power(n, 22)));
  params[5] = static_cast<float>(std::sin(double{hair.alpha_degrees} * M_PI / 180));
  params[6] = hair.eta;
}

}  // namespace lightmill
