#include "worker/render/scene/shutter.h"

#include <algorithm>
#include <cmath>

namespace lightmill {

std::vector<float> shutter_times(const std::vector<double>& openness, int steps) {
  if (openness.size() < 2) return {};
  const size_t parts = openness.size() - 1;
  std::vector<double> sums(parts + 1);  // light up to each value, in parts
  for (size_t i = 0; i < parts; ++i) sums[i + 1] = sums[i] + (openness[i] + openness[i + 1]) / 2;
  std::vector<float> times;
  for (int step = 0; step <= steps; ++step) {
    const double wanted = sums.back() * step / steps;
    const auto after = std::upper_bound(sums.begin() + 1, sums.end() - 1, wanted);
    const auto i = static_cast<size_t>(after - sums.begin()) - 1;
    // Within a part the openness goes straight from a to b: a x + (b - a) x^2 / 2 is what is left.
    const double a = openness[i], b = openness[i + 1], left = std::max(wanted - sums[i], 0.0);
    const double root = std::sqrt(std::max(a * a + 2 * (b - a) * left, 0.0));
    const double x = a + root > 0 ? 2 * left / (a + root) : 0;
    times.push_back(
        static_cast<float>((static_cast<double>(i) + std::min(x, 1.0)) / static_cast<double>(parts)));
  }
  return times;
}

}  // namespace lightmill
