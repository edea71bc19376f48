// Russian roulette where next to nothing is lost: paths end, and the variance stays finite.
#include "worker/render/pipeline/paths/roulette.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/render.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

// Every path of a lossless closed scene ends: 2 * 1024 events on average, as the caps' telescoping product
// gives.
TEST(Roulette, PathsThatLoseNothingEnd) {
  double alive = 1, events = 0;
  for (int n = 1; n < 4000000; ++n) {
    events += alive;
    alive *= double{roulette_cap(n)};
  }
  EXPECT_NEAR(events, 2 * kRouletteCapStart, 0.01 * kRouletteCapStart);
  EXPECT_LT(alive, 1e-6);
}

// The second moment of sum_n rho^n relative to its mean's square. Without a cap it is about 2; a cap of
// 0.999 would make it infinite from rho = 0.9995 on.
TEST(Roulette, SecondMomentIsFiniteUpToTheLastDigitsOfTheAlbedo) {
  const auto second_moment = [](double rho) {
    double reached = 1, sum = 0;  // `reached`: event n, with throughput rho^n / reached
    for (int n = 0; n < 4000000; ++n) {
      sum += std::pow(rho, 2 * n) / reached;
      reached *= std::min(rho, double{roulette_cap(n + 1)});
    }
    return 2 * (1 - rho) * sum;
  };
  EXPECT_LT(second_moment(0.99), 2.1);
  EXPECT_LT(second_moment(0.999), 3);
  EXPECT_LT(second_moment(0.9999), 60);
  EXPECT_LT(second_moment(0.99999), 6000);
}

// Oracle 1: a closed box that emits 1 and reflects 0.9999, without a depth limit: 10,000. The interval tells
// errors of 35 %.
TEST(Roulette, BoxOfAlbedo09999) {
  TestScene s;
  s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(0.9999f), {.radiance = {1, 1, 1}, .inward = true});
  s.camera({0.2, -0.1, 0.3}, {1, 0.4, 0.6}, 60).film(16, 16);
  RenderSettings settings = settings_for(s.scene, Integrator::kPt, 256, kUnlimitedDepth);
  settings.plan = SamplingPlan{.strategies = kEmissionHits};
  const Batches b = render_batches(s.scene, settings, 16);
  EXPECT_EQ(b.counters.nonfinite, 0u);
  EXPECT_TRUE(mean_is(b.mean(), 1 / (1 - double{0.9999f}), {.resolution = 0.35}));
}

}  // namespace
}  // namespace lightmill::test
