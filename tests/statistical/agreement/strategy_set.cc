#include "tests/statistical/agreement/strategy_set.h"

#include <gtest/gtest.h>

namespace lightmill::test {
namespace {

constexpr int kBatches = 16;

}  // namespace

Batches render_plan(const TestScene& s, const SamplingPlan& plan, int64_t spp, int max_depth) {
  RenderSettings settings = settings_for(s.scene, Integrator::kBdpt, spp, max_depth, 1 + plan.strategies);
  settings.plan = plan;
  return render_batches(s.scene, settings, kBatches);
}

void expect_agrees_with_all(const TestScene& s, Strategies set, const StrategySetTest& test) {
  const auto render = [&](Strategies strategies, int64_t spp, int max_depth) {
    return render_plan(s, SamplingPlan{.strategies = strategies}, spp, max_depth);
  };
  const Batches all = render(kAllStrategies, test.all_spp, test.max_depth);
  // Without next event and light tracing, or with connections from afar, a sample tells little.
  const bool weak = !(set & (kNextEvent | kLightTracing)) || !(set & (kEmissionHits | kNextEvent));
  const Batches some = render(set, weak ? test.weak_spp : test.spp, test.max_depth);
  EXPECT_EQ(some.counters.nonfinite, 0u);
  AgreementTest agreement;
  agreement.max_relative_error = 0.2;
  if (set & (kEmissionHits | kNextEvent | kLightTracing)) {
    EXPECT_TRUE(images_agree(all, some, agreement));
    EXPECT_FALSE(images_agree(all, scaled(some, test.notice), agreement)) << "the test notices nothing";
    return;
  }
  // Connections alone make the paths of two and more scattering events.
  const Batches once = render(kNextEvent, test.once_spp, 1);
  Batches deeper = all;
  for (size_t b = 0; b < deeper.images.size(); ++b) {
    for (size_t i = 0; i < deeper.images[b].data.size(); ++i)
      deeper.images[b].data[i] -= once.images[b].data[i];
  }
  agreement.max_excluded = 0.2;
  EXPECT_TRUE(images_agree(deeper, some, agreement));
  EXPECT_FALSE(images_agree(deeper, scaled(some, test.connections_notice), agreement))
      << "the test notices nothing";
}

}  // namespace lightmill::test
