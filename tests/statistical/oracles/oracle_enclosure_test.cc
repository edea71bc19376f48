// Scenes whose radiance is known in closed form because everything encloses everything: closed emissive
// boxes, furnaces, spheres around their light. alpha = 1e-4 per comparison; each states the error that it
// would notice.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/render.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

constexpr int kBatches = 16;

class Enclosure : public ::testing::TestWithParam<Integrator> {
 protected:
  Batches render(const TestScene& s, int max_depth, int64_t spp) const {
    Batches b = render_batches(s.scene, settings_for(s.scene, GetParam(), spp, max_depth), kBatches);
    EXPECT_EQ(b.counters.nonfinite, 0u);
    return b;
  }
};

/// Sum of a geometric series of `terms` terms.
double series(double ratio, int terms) { return (1 - std::pow(ratio, terms)) / (1 - ratio); }

// Oracle 1: a closed box that emits 1 and reflects rho: Le (1 - rho^k) / (1 - rho) with k =
// max_depth + 1 terms.
TEST_P(Enclosure, EmissiveBoxIsAGeometricSeries) {
  for (const float rho : {0.2f, 0.5f, 0.8f}) {
    for (const int max_depth : {0, 1, 2, 5, 12}) {
      TestScene s;
      s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(rho), {.radiance = {1, 0.5f, 2}, .inward = true});
      s.camera({0.2, -0.1, 0.3}, {1, 0.4, 0.6}, 60).film(16, 16);
      const Batches b = render(s, max_depth, 512);
      const double exact = series(rho, max_depth + 1);
      const MeanTest test{.resolution = GetParam() == Integrator::kLt ? 0.06 : 0.02};
      SCOPED_TRACE(testing::Message() << "rho " << rho << " depth " << max_depth);
      EXPECT_TRUE(mean_is(b.mean(0), exact, test));
      EXPECT_TRUE(mean_is(b.mean(1), 0.5 * exact, test));
      EXPECT_TRUE(mean_is(b.mean(2), 2 * exact, test));
    }
  }
}

TEST_P(Enclosure, EmissiveBoxWithoutADepthLimit) {
  TestScene s;
  s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(0.8f), {.radiance = {1, 1, 1}, .inward = true});
  s.camera({0.2, -0.1, 0.3}, {1, 0.4, 0.6}, 60).film(16, 16);
  EXPECT_TRUE(mean_is(render(s, kUnlimitedDepth, 512).mean(), 5.0, {.resolution = 0.06}));
}

// Oracle 1 with a coloured albedo: channels must not mix.
TEST_P(Enclosure, ColouredBoxKeepsChannelsApart) {
  TestScene s;
  s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(Rgb{0.9f, 0.5f, 0.0f}), {.radiance = {1, 1, 1}, .inward = true});
  s.camera({0.2, -0.1, 0.3}, {1, 0.4, 0.6}, 60).film(16, 16);
  const Batches b = render(s, 3, 512);
  const MeanTest test{.resolution = 0.06};
  EXPECT_TRUE(mean_is(b.mean(0), series(0.9, 4), test));
  EXPECT_TRUE(mean_is(b.mean(1), series(0.5, 4), test));
  EXPECT_TRUE(mean_is(b.mean(2), 1.0, test));
}

// Oracle 5: a point light of intensity I at the centre of a diffuse sphere of radius R: every bounce adds
// rho^k I / R^2 of irradiance.
TEST_P(Enclosure, SphereAroundAPointLight) {
  constexpr float kRadius = 2, kIntensity = 3, kRho = 0.6f;
  for (const int max_depth : {1, 2, 4}) {
    TestScene s;
    s.sphere({0, 0, 0}, kRadius, s.diffuse(kRho));
    s.point_light({0, 0, 0}, {kIntensity, kIntensity, kIntensity});
    s.camera({0.5, 0.3, -0.7}, {1, 0, 1}, 50).film(16, 16);
    const double direct = kRho / M_PI * kIntensity / (kRadius * kRadius);
    EXPECT_TRUE(mean_is(render(s, max_depth, 512).mean(), direct * series(kRho, max_depth),
                        {.resolution = GetParam() == Integrator::kLt ? 0.06 : 0.02}))
        << "depth " << max_depth;
  }
}

// Oracle 6: concentric diffuse spheres. Radiosity: B1 = E1 + r1 B2, B2 = E2 + r2 (F21 B1 + (1 - F21) B2).
TEST_P(Enclosure, ConcentricSpheres) {
  constexpr float kR1 = 0.5f, kR2 = 1.0f, kRho1 = 0.7f, kRho2 = 0.4f;
  TestScene s;
  s.sphere({0, 0, 0}, kR1, s.diffuse(kRho1), {.radiance = {1, 1, 1}});
  s.sphere({0, 0, 0}, kR2, s.diffuse(kRho2), {.inward = true});
  const double f21 = kR1 * kR1 / (kR2 * kR2);
  // B2 = r2 f21 (1 + r1 B2) + r2 (1 - f21) B2.
  const double b2 = kRho2 * f21 / (1 - kRho2 * f21 * kRho1 - kRho2 * (1 - f21)), b1 = 1 + kRho1 * b2;
  const MeanTest test{.resolution = GetParam() == Integrator::kLt ? 0.1 : 0.03};
  const int64_t spp = GetParam() == Integrator::kLt ? 2048 : 512;
  s.camera({0, 0.75, 0}, {0, 2, 0}, 60).film(16, 16);
  EXPECT_TRUE(mean_is(render(s, kUnlimitedDepth, spp).mean(), b2, test));
  s.camera({0, 0.75, 0}, {0, 0, 0}, 40);
  EXPECT_TRUE(mean_is(render(s, kUnlimitedDepth, spp).mean(), b1, test));
}

// Oracle 2: a convex diffuse object in a constant environment reflects rho L0 from everywhere.
TEST_P(Enclosure, ConvexObjectInAConstantEnvironment) {
  for (const bool sphere : {true, false}) {
    TestScene s;
    const int m = s.diffuse(Rgb{0.8f, 0.4f, 0.1f});
    if (sphere) {
      s.sphere({0, 0, 0}, 1, m);
    } else {
      s.box({-1, -1, -1}, {1, 1, 1}, m);
    }
    s.environment({2, 2, 2}).camera({0.4, 0.9, -3}, {0, 0, 0}, 20).film(16, 16);
    const bool lt = GetParam() == Integrator::kLt;
    const Batches b = render(s, 3, lt ? 8192 : 512);
    const MeanTest test{.resolution = lt ? 0.1 : 0.02};
    SCOPED_TRACE(sphere ? "sphere" : "box");
    EXPECT_TRUE(mean_is(b.mean(0), 1.6, test));
    EXPECT_TRUE(mean_is(b.mean(1), 0.8, test));
    EXPECT_TRUE(mean_is(b.mean(2), 0.2, test));
  }
}

INSTANTIATE_TEST_SUITE_P(All, Enclosure,
                         ::testing::Values(Integrator::kPt, Integrator::kBdpt, Integrator::kLt),
                         [](const auto& info) { return name_of(info.param); });

}  // namespace
}  // namespace lightmill::test
