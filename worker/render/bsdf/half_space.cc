#include "worker/render/bsdf/half_space.h"

#include <algorithm>
#include <cmath>

namespace lightmill {

// R (1 + 1.17 s) = 1 - 1.139 s + 0.139 s^2 is a quadratic in s; of its roots the smaller one is in [0, 1].
float albedo_of_body(float reflectance, float leaves, float g) {
  const double r = double{reflectance} / (double{leaves} + (1 - double{leaves}) * double{reflectance});
  const double half = (1.139 + 1.17 * r) / 2, rest = 0.139 * (1 - r);
  const double s = std::clamp((1 - r) / (half + std::sqrt(half * half - rest)), 0.0, 1.0), s2 = s * s;
  return static_cast<float>((1 - s2) / (1 - double{g} * s2));
}

}  // namespace lightmill
