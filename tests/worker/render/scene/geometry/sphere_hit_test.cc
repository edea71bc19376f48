// The ray-sphere root against long double, far away, close by and from inside.
#include "worker/render/scene/geometry/sphere_hit.h"

#include <gtest/gtest.h>

#include "tests/support/statistics.h"

namespace lightmill::test {
namespace {

/// Smallest root above 0 in long double, or -1; `margin` is the discriminant relative to r^2.
long double reference(const float o[3], const float d[3], const float s[4], long double* margin) {
  long double f[3], a = 0, b = 0, ff = 0;
  for (int i = 0; i < 3; ++i) {
    f[i] = static_cast<long double>(o[i]) - s[i];
    a += static_cast<long double>(d[i]) * d[i];
    b += f[i] * d[i];
    ff += f[i] * f[i];
  }
  const long double r2 = static_cast<long double>(s[3]) * s[3];
  long double perpendicular = 0;
  for (int i = 0; i < 3; ++i) {
    const long double p = f[i] - b / a * d[i];
    perpendicular += p * p;
  }
  *margin = (r2 - perpendicular) / r2;
  if (perpendicular > r2) return -1;
  const long double root = std::sqrt((r2 - perpendicular) / a);
  const long double t0 = -b / a - root, t1 = -b / a + root;
  if (t0 > 0) return t0;
  return t1 > 0 ? t1 : -1;
}

TEST(SphereHit, MatchesLongDouble) {
  Random random(1);
  int hits = 0;
  for (int i = 0; i < 200000; ++i) {
    float o[3], d[3], s[4];
    const double distance = std::pow(10.0, random.between(-3, 3)),
                 radius = std::pow(10.0, random.between(-4, 2));
    for (int k = 0; k < 3; ++k) {
      o[k] = static_cast<float>(random.between(-1, 1));
      d[k] = static_cast<float>(random.between(-1, 1));
    }
    const double n = std::sqrt(double{d[0]} * d[0] + double{d[1]} * d[1] + double{d[2]} * d[2]);
    if (n < 0.1) continue;
    for (int k = 0; k < 3; ++k) {
      d[k] = static_cast<float>(d[k] / n);
      s[k] = static_cast<float>(o[k] + d[k] * distance + random.between(-1, 1) * radius);
    }
    s[3] = static_cast<float>(radius);
    long double margin;
    const long double exact = reference(o, d, s, &margin);
    if (std::fabs(margin) < 1e-6L) continue;  // grazing: either answer is right
    const double t = sphere_hit(o, d, s, 0, 1e300);
    if (exact <= 0) {
      ASSERT_LT(t, 0);
    } else {
      // Near the surface a root is a difference: absolute error by the radius, relative to the
      // distance beyond.
      ASSERT_NEAR(t, static_cast<double>(exact), 1e-9 * (static_cast<double>(exact) + radius));
      ++hits;
    }
  }
  EXPECT_GT(hits, 50000);
}

TEST(SphereHit, FarAwayAndTiny) {
  const float o[3] = {0, 0, 0}, d[3] = {0, 0, 1}, s[4] = {0, 0, 1e6f, 1e-3f};
  EXPECT_NEAR(sphere_hit(o, d, s, 0, 1e300), 1e6 - 1e-3, 1e-6);
  const float beside[4] = {1.1e-3f, 0, 1e6f, 1e-3f};
  EXPECT_LT(sphere_hit(o, d, beside, 0, 1e300), 0);
}

TEST(SphereHit, LimitsAreRespected) {
  const float o[3] = {0, 0, 0}, d[3] = {0, 0, 1}, s[4] = {0, 0, 5, 1};
  EXPECT_NEAR(sphere_hit(o, d, s, 0, 10), 4, 1e-12);
  EXPECT_NEAR(sphere_hit(o, d, s, 4.5, 10), 6, 1e-12);
  EXPECT_LT(sphere_hit(o, d, s, 0, 3.9), 0);
  EXPECT_LT(sphere_hit(o, d, s, 6.1, 10), 0);
  const float away[3] = {0, 0, -1};
  EXPECT_LT(sphere_hit(o, away, s, 0, 10), 0);
}

/// A float whose size is anything, or one of those that are no size at all.
float any_float(Random* random) {
  constexpr float kOdd[] = {0, -0.0f, 1e-45f, 3e38f, std::numeric_limits<float>::infinity(), std::nanf("")};
  const double pick = random->between(0, 12);
  if (pick < 6) return kOdd[static_cast<int>(pick)];
  return static_cast<float>(random->between(-1, 1) * std::pow(10.0, random->between(-30, 30)));
}

// Lanes have the bits of the scalar form, whatever they are asked.
TEST(SphereHit, LanesAreTheScalarForm) {
  Random random(3);
  int hits = 0;
  for (int i = 0; i < 50000; ++i) {
    float o[4][3], d[4][3], s[4];
    for (float& x : s) x = i % 2 ? any_float(&random) : static_cast<float>(random.between(-1, 1));
    s[3] = std::fabs(s[3]);
    for (int l = 0; l < 4; ++l) {
      for (int k = 0; k < 3; ++k) {
        o[l][k] = i % 4 == 1 ? any_float(&random) : static_cast<float>(random.between(-1, 1));
        d[l][k] = i % 4 == 3 ? any_float(&random) : static_cast<float>(random.between(-1, 1));
      }
    }
    const auto lanes = [](const float v[4][3], int k) { return Double4{v[0][k], v[1][k], v[2][k], v[3][k]}; };
    const Vec3<Double4> from{lanes(o, 0) - s[0], lanes(o, 1) - s[1], lanes(o, 2) - s[2]};
    const Vec3<Double4> along{lanes(d, 0), lanes(d, 1), lanes(d, 2)};
    const Double4 t = sphere_hit<Double4>(from, along, Double4{} + s[3], Double4{}, Double4{} + 1e300);
    for (int l = 0; l < 4; ++l) {
      const double scalar = sphere_hit(o[l], d[l], s, 0, 1e300);
      ASSERT_EQ(std::bit_cast<uint64_t>(t[l]), std::bit_cast<uint64_t>(scalar)) << i;
      hits += scalar > 0;
    }
  }
  EXPECT_GT(hits, 10000);
}

}  // namespace
}  // namespace lightmill::test
