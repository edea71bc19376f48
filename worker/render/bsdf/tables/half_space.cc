#include "worker/render/bsdf/tables/half_space.h"

#include <algorithm>
#include <cmath>

#include "worker/render/bsdf/layered/coat_transfer.h"

namespace lightmill {

// R (1 + 1.17 s) = 1 - 1.139 s + 0.139 s^2 is a quadratic in s; of its roots the smaller one is in [0, 1].
float albedo_of_body(float reflectance, float leaves, float g) {
  const double r = double{reflectance} / (double{leaves} + (1 - double{leaves}) * double{reflectance});
  const double half = (1.139 + 1.17 * r) / 2, rest = 0.139 * (1 - r);
  const double s = std::clamp((1 - r) / (half + std::sqrt(half * half - rest)), 0.0, 1.0), s2 = s * s;
  return static_cast<float>((1 - s2) / (1 - double{g} * s2));
}

double refracted_body_reflectance(const CoatDescription& boundary, double albedo, double g) {
  if (albedo >= 1) return 1;
  // Of light that has diffused so far e^-32 is left.
  const double length = 1 / std::sqrt(3 * (1 - albedo) * (1 - albedo * g));
  const Slab deep = scattering_slab(32 * std::max(length, 1 / (1 - g)), albedo, g);
  const CoatResponse response = coat_response(deep, coat_inside_reflection(boundary), Operator{});
  Field entering{};
  for (size_t i = 0; i < kStreams; ++i) {
    const double mu = streams().cosine[i], diffuse = 2 * mu * streams().weight[i];
    const Field part = coat_entering_field(boundary, static_cast<float>(mu));
    for (size_t k = 0; k < kStreams; ++k) entering[k] += diffuse * part[k];
  }
  const Field met = product(response.top_of_entering, entering), leaving = coat_leaving(boundary);
  double in = 0, out = 0;
  for (size_t k = 0; k < kStreams; ++k) {
    in += entering[k];
    out += leaving[k] * met[k];
  }
  return std::clamp(out / in, 0.0, 1.0);
}

float walk_albedo(const CoatDescription& boundary, float albedo, float g, float leaves) {
  return albedo_of_body(static_cast<float>(refracted_body_reflectance(boundary, double{albedo}, double{g})),
                        leaves, g);
}

}  // namespace lightmill
