#pragma once
// Directions for tests of geometry.
#include "tests/support/statistics.h"
#include "worker/render/math/vec.h"

namespace lightmill::test {

/// Uniform on the unit sphere, by rejection.
inline Vec3<float> unit(Random& random) {
  for (;;) {
    const Vec3<float> v{static_cast<float>(random.between(-1, 1)), static_cast<float>(random.between(-1, 1)),
                        static_cast<float>(random.between(-1, 1))};
    const float n = dot(v, v);
    if (n > 0.01f && n < 1) return normalize(v);
  }
}

}  // namespace lightmill::test
