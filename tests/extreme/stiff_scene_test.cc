// Numbers at the ends of their ranges: albedos near one, lights of very different power, size or number.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/render.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

constexpr int kBatches = 16;

class Stiff : public ::testing::TestWithParam<Integrator> {
 protected:
  Batches render(const TestScene& s, int max_depth, int64_t spp) const {
    Batches b = render_batches(s.scene, settings_for(s.scene, GetParam(), spp, max_depth), kBatches);
    EXPECT_EQ(b.counters.nonfinite, 0u);
    return b;
  }
};

/// Views so small that no light path lands in them: for the integrators that start at the camera.
class StiffView : public Stiff {};

// Oracle 1 at rho = 0.999: Le / (1 - rho) = 1000 from paths of a thousand events.
TEST_P(Stiff, ClosedBoxOfAlbedo999) {
  TestScene s;
  s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(0.999f), {.radiance = {1, 1, 1}, .inward = true});
  s.camera({0.2, -0.1, 0.3}, {1, 0.4, 0.6}, 60).film(4, 4);
  EXPECT_TRUE(
      mean_is(render(s, kUnlimitedDepth, 256).mean(), 1 / (1 - double{0.999f}), {.resolution = 0.15}));
}

// A box that loses nothing at all: rendering ends at every depth.
TEST_P(Stiff, LosslessBoxEnds) {
  for (const float rho : {0.98f, 1.0f}) {
    for (const int max_depth : {0, 1, 20, kUnlimitedDepth}) {
      TestScene s;
      s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(rho)).sphere({0, 0, 0.4}, 0.3, s.dielectric(1.5f, 0));
      s.point_light({0, 0.5, 0}, {1, 1, 1}).camera({0.2, -0.1, -0.7}, {0, 0, 1}, 60).film(4, 4);
      const Batches b = render(s, max_depth, 256);
      EXPECT_TRUE(std::isfinite(b.mean().mean));
      if (max_depth == 0) {
        EXPECT_EQ(b.mean().mean, 0);
      } else if (max_depth == kUnlimitedDepth) {
        EXPECT_GT(b.mean().mean, 0);
      }
    }
  }
}

// Two lamps of which one is 1e5 times as bright, each in a channel of its own, over a floor:
// each channel is right.
TEST_P(StiffView, IntensitiesOneToOneHundredThousand) {
  TestScene s;
  s.quad({-10, 0, -10}, {0, 0, 20}, {20, 0, 0}, s.diffuse(0.5f));
  const int black = s.diffuse(0);
  s.sphere({0, 2, 0}, 1, black, {.radiance = {0, 1, 0}});
  s.sphere({4, 3, 0}, 1, black, {.radiance = {1e5f, 0, 0}});
  s.camera({0.5, 0.8, -1}, {0, 0, 0}, 4).film(8, 8);
  const Batches b = render(s, 1, 8192);
  // E = pi L (r / d)^2 cos, at the middle of a small view.
  EXPECT_TRUE(
      mean_is(b.mean(0), 0.5 * 1e5 * 3 / std::pow(25.0, 1.5), {.resolution = 0.01, .rounding = 5e-3}));
  EXPECT_TRUE(mean_is(b.mean(1), 0.5 * 1 * 2 / std::pow(4.0, 1.5), {.resolution = 0.1, .rounding = 5e-3}));
}

// Oracle 8 at r / d = 1e-6 and less.
TEST_P(StiffView, TinySphereLight) {
  for (const double ratio : {1e-5, 1e-6, 1e-7}) {
    TestScene s;
    s.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, s.diffuse(0.5f));
    const auto radiance = static_cast<float>(1 / (ratio * ratio));
    s.sphere({0, 1, 0}, ratio, s.diffuse(0), {.radiance = {radiance, radiance, radiance}});
    s.camera({0.5, 0.8, -1}, {0, 0, 0}, 1).film(8, 8);
    EXPECT_TRUE(mean_is(render(s, 1, 256).mean(), 0.5, {.resolution = 0.01, .rounding = 2e-3})) << ratio;
  }
}

// Ten thousand lamps that tile a ceiling are one large lamp.
TEST_P(Stiff, TenThousandLights) {
  TestScene many, one;
  constexpr int kSide = 71;  // 2 x 71^2 = 10,082 triangles
  for (TestScene* s : {&many, &one}) {
    s->quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, s->diffuse(0.5f));
    s->camera({0.5, 0.9, -1.5}, {0, 0, 0.3}, 30).film(8, 8);
  }
  const int black = many.diffuse(0);
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) {
      const double d = 2.0 / kSide;
      many.quad({-1 + d * i, 1, -1 + d * j}, {d, 0, 0}, {0, 0, d}, black, {.radiance = {1, 1, 1}});
    }
  }
  one.quad({-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, one.diffuse(0), {.radiance = {1, 1, 1}});
  const int64_t spp = GetParam() == Integrator::kLt ? 4096 : 512;
  EXPECT_TRUE(means_agree(render(many, 2, spp).mean(), render(one, 2, spp).mean(),
                          {.resolution = GetParam() == Integrator::kLt ? 0.1 : 0.03}));
}

// Ten thousand lamps whose powers span eight decades.
TEST_P(StiffView, TenThousandLightsOfAllPowers) {
  TestScene s;
  s.box({-2, -2, -2}, {2, 2, 2}, s.diffuse(0.5f));
  Random random(5);
  double direct = 0;
  for (int i = 0; i < 10000; ++i) {
    const double power = std::pow(10.0, random.between(-8, 0));
    const Vec3d p{random.between(-1.9, 1.9), random.between(-1.9, 1.9), random.between(-1.9, 1.9)};
    const auto f = static_cast<float>(power);
    s.point_light(p, {f, f, f});
    // Exact light on the wall z = 2 at its middle, where the camera looks.
    const double d2 = p.x * p.x + p.y * p.y + (2 - p.z) * (2 - p.z);
    direct += power * (2 - p.z) / std::pow(d2, 1.5);
  }
  s.camera({0, 0, -1.9}, {0, 0, 2}, 0.5).film(8, 8);
  EXPECT_TRUE(mean_is(render(s, 1, 4096).mean(), 0.5 / M_PI * direct, {.resolution = 0.1, .rounding = 1e-2}));
}

INSTANTIATE_TEST_SUITE_P(All, StiffView, ::testing::Values(Integrator::kPt, Integrator::kBdpt),
                         [](const auto& info) { return name_of(info.param); });
INSTANTIATE_TEST_SUITE_P(All, Stiff, ::testing::Values(Integrator::kPt, Integrator::kBdpt, Integrator::kLt),
                         [](const auto& info) { return name_of(info.param); });

}  // namespace
}  // namespace lightmill::test
