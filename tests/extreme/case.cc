#include "tests/extreme/case.h"

#include <cstdio>

namespace lightmill::test {

bool Sight::covered_by(Strategies set) const {
  if (first == 0 && !(set & none)) return false;
  if (first <= 1 && last >= 1 && !(set & one)) return false;
  if (last < 2) return true;
  // Paths longer than light subpaths are stored are left to hits and next event. Of the other families only
  // light tracing goes on, if it is alone: then it is the integrator lt.
  constexpr int kStored = 20;
  if (last > kStored && !(set & more & (kEmissionHits | kNextEvent)))
    return set == kLightTracing && more & set;
  return set & more;
}

Sight area_light_sight(int first, int last) {
  return {kEmissionHits | kLightTracing, kEmissionHits | kNextEvent | kLightTracing, kAllStrategies, first,
          last};
}

Sight delta_light_sight(int first, int last) {
  return {0, kNextEvent | kLightTracing, kAllStrategies & ~kEmissionHits, first, last};
}

Sight far_light_sight(int first, int last) {
  return {kEmissionHits, kEmissionHits | kNextEvent | kLightTracing, kAllStrategies, first, last};
}

Sight specular_sight() { return only_hits(kUnlimitedDepth); }

Sight only_hits(int last) { return {kEmissionHits, kEmissionHits, kEmissionHits, 0, last}; }

Sight without_lens(Sight sight) {
  sight.none &= ~kLightTracing;
  sight.one &= ~kLightTracing;
  sight.more &= ~kLightTracing;
  return sight;
}

std::string text(double x) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.7g", x);
  return buffer;
}

}  // namespace lightmill::test
