#include "worker/render/bsdf/fresnel.h"

#include <cmath>

namespace lightmill {

double internal_diffuse_fresnel(double eta) {
  constexpr int kSteps = 4096;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double mu = (i + 0.5) / kSteps;
    const double cos_t = std::sqrt(std::max(0.0, 1 - (1 - mu * mu) / (eta * eta)));
    const double parallel = (eta * mu - cos_t) / (eta * mu + cos_t);
    const double perpendicular = (mu - eta * cos_t) / (mu + eta * cos_t);
    sum += 2 * mu * 0.5 * (parallel * parallel + perpendicular * perpendicular) / kSteps;
  }
  return 1 - (1 - sum) / (eta * eta);
}

}  // namespace lightmill
