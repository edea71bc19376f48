// Any set of strategy families is an unbiased estimator of the paths that its members can make: weights sum
// to one over the set that is on.
//
// Every comparison is of 16 independent batches a side, two-sided, alpha = 1e-4 over all blocks and channels;
// each must also fail when one image is scaled by 1.06.
#include <gtest/gtest.h>

#include "tests/statistical/agreement/strategy_set.h"

namespace lightmill::test {
namespace {

/// A room whose lamp is out of sight, with a half glossy block.
TestScene room() {
  TestScene s = cornell_room();
  s.box({-0.2, -0.999, 0.3}, {0.3, -0.6, 0.7}, s.conductor(0.8f, 0.4f));
  s.camera({0, 0.6, -0.95}, {0, -1, 0.3}, 70).film(16, 16);
  return s;
}

/// A ball on a slab under a constant sky, seen from above; nothing of the sky is in sight.
TestScene open_air() {
  TestScene s;
  s.quad({-3, 0, -3}, {0, 0, 6}, {6, 0, 0}, s.diffuse({0.6f, 0.5f, 0.3f}));
  s.sphere({0, 1, 0}, 1, s.diffuse(0.7f));
  s.environment({1, 1.2f, 1.5f});
  s.camera({0, 6, 0.01}, {0, 0, 0}, 40).film(16, 16);
  return s;
}

class StrategySet : public ::testing::TestWithParam<unsigned> {};

TEST_P(StrategySet, AgreesInARoom) { expect_agrees_with_all(room(), GetParam(), {.max_depth = 6}); }

// An open scene needs paths from far away: light tracing and connections by light paths that start on a large
// disk.
TEST_P(StrategySet, AgreesUnderTheSky) {
  expect_agrees_with_all(open_air(), GetParam(), {.max_depth = 4, .connections_notice = 2});
}

/// How many light paths and connections go with a camera path shows in the noise only; also where the crop
/// window cuts cells, so that these have fewer light paths.
TEST(PlanCounts, AgreeWithOneOfEach) {
  TestScene s = room();
  s.film(40, 20);
  s.scene.film.crop = {0.1, 0.9, 0, 0.9};
  s.scene.filter = FilterDescription();
  const Batches one = render_plan(s, SamplingPlan{.strategies = kAllStrategies}, 256, 6);
  AgreementTest test;
  test.max_relative_error = 0.2;
  constexpr Strategies kNoLens = kAllStrategies & ~kLightTracing;
  constexpr Strategies kNoConnections = kAllStrategies & ~kVertexConnections;
  for (const SamplingPlan& plan :
       {SamplingPlan{kAllStrategies, 0.25, 0.25}, SamplingPlan{kAllStrategies, 0.25, 4},
        SamplingPlan{kAllStrategies, 2, 0.5}, SamplingPlan{kAllStrategies, 0.5, 2},
        SamplingPlan{kNoLens, 0.25, 2}, SamplingPlan{kNoLens, 2, 0.25}, SamplingPlan{kNoConnections, 0.25, 1},
        SamplingPlan{kNoConnections, 2, 1}, SamplingPlan{kLightTracing, 2, 1},
        SamplingPlan{kAllStrategies, 1, 1, 0.125}, SamplingPlan{kAllStrategies, 0.5, 2, 3},
        SamplingPlan{kNoConnections, 1, 1, 0.125}}) {
    SCOPED_TRACE(plan_to_json(plan));
    const Batches other = render_plan(s, plan, 512, 6);
    EXPECT_EQ(other.counters.nonfinite, 0u);
    EXPECT_TRUE(images_agree(one, other, test));
    EXPECT_FALSE(images_agree(one, scaled(other, 1.06f), test)) << "the test notices nothing";
  }
}

INSTANTIATE_TEST_SUITE_P(All, StrategySet, ::testing::Range(1u, kAllStrategies + 1), set_name);

}  // namespace
}  // namespace lightmill::test
