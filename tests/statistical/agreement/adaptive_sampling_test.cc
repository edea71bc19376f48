// Adaptive sampling changes the noise and nothing else. Comparisons are of 16 independent batches a side,
// two-sided, alpha = 1e-4 over all blocks and channels; each must also fail when one image is scaled.
#include <gtest/gtest.h>

#include <random>

#include "common/film/film.h"
#include "tests/support/agreement.h"
#include "tests/support/test_scene.h"
#include "worker/render/plan/pilot.h"

namespace lightmill::test {
namespace {

constexpr int kBatches = 16;

SampleAllocation random_allocation(const FilmGrid& grid, unsigned seed) {
  std::mt19937 random(seed);
  SampleAllocation map{std::string(static_cast<size_t>(regions_of(grid).count()), '0')};
  for (char& c : map.levels) c = static_cast<char>('0' + random() % 5);
  return map;
}

/// A floor, half of it nearly black, under a small lamp: relative noise is in the bright half.
TestScene two_floors() {
  TestScene s;
  s.quad({-2, 0, -2}, {0, 0, 4}, {2, 0, 0}, s.diffuse(0.8f));
  s.quad({0, 0, -2}, {0, 0, 4}, {2, 0, 0}, s.diffuse(0.004f));
  s.quad({-0.6, 0.5, -0.6}, {1.2, 0, 0}, {0, 0, 1.2}, s.diffuse(0.0f), Emits{{3, 3, 3}});
  s.camera({0, 3, 0.01}, {0, 0, 0}, 40);
  return s.film(16, 16);
}

class AllocationOf : public ::testing::TestWithParam<SamplingPlan> {};

/// Every strategy, beside one that is left uniform; the crop window cuts cells and regions.
TEST_P(AllocationOf, AgreesWithUniform) {
  TestScene s = cornell_room();
  s.box({-0.2, -0.999, 0.3}, {0.3, -0.6, 0.7}, s.conductor(0.8f, 0.4f));
  s.camera({0, 0.6, -0.95}, {0, -1, 0.3}, 70).film(44, 24);
  s.scene.film.crop = {0.06, 0.95, 0, 0.9};
  s.scene.filter = FilterDescription();  // splats reach over the edges of crop window and regions
  const Batches uniform = render_batches(s.scene, settings_for(s.scene, Integrator::kBdpt, 256, 6), kBatches);
  RenderSettings settings = settings_for(s.scene, Integrator::kBdpt, 512, 6, 2);
  settings.plan = GetParam();
  settings.plan->allocation = random_allocation(settings.grid, 5);
  const Batches adapted = render_batches(s.scene, settings, kBatches);
  EXPECT_EQ(adapted.counters.nonfinite, 0u);
  AgreementTest test;
  test.max_relative_error = 0.2;
  EXPECT_TRUE(images_agree(uniform, adapted, test));
  EXPECT_FALSE(images_agree(uniform, scaled(adapted, 1.06f), test)) << "the test notices nothing";
}

INSTANTIATE_TEST_SUITE_P(Plans, AllocationOf,
                         ::testing::Values(SamplingPlan{}, SamplingPlan{kAllStrategies, 0.25, 2},
                                           SamplingPlan{kAllStrategies, 1, 1, 0.125},
                                           SamplingPlan{kEmissionHits | kNextEvent, 1, 1},
                                           SamplingPlan{kNextEvent | kLightTracing, 0.5, 1},
                                           SamplingPlan{kEmissionHits | kLightTracing, 2, 1},
                                           SamplingPlan{kEmissionHits | kNextEvent | kVertexConnections, 1,
                                                        1}));

// The whole of it: each of 1,008 renders with a pilot of its own, whose noise decides where its samples go.
TEST(AdaptiveSampling, OfAPilotLeavesTheMeanOverSeedsAlone) {
  const TestScene s = two_floors();
  const Batches truth =
      render_batches(s.scene, settings_for(s.scene, Integrator::kPt, 16384, 3), kBatches, 2);
  Batches means;
  int adapted = 0;
  for (int b = 0; b < kBatches; ++b) {
    constexpr int kSeeds = 63;
    Image mean(16, 16);
    for (int i = 0; i < kSeeds; ++i) {
      RenderSettings settings =
          settings_for(s.scene, Integrator::kAuto, 14, 3, static_cast<uint64_t>(100 + b * kSeeds + i));
      const Renderer renderer(s.scene, settings, 1);
      settings.plan = run_pilot(renderer, 1, [] { return true; }).chosen;
      adapted += !settings.plan->allocation.uniform();
      Film film(settings.grid);
      film.fold(render_partial(s.scene, settings));
      const Image image = film.resolve();
      for (size_t k = 0; k < mean.data.size(); ++k) mean.data[k] += image.data[k] / kSeeds;
    }
    means.images.push_back(mean);
  }
  EXPECT_GT(adapted, 900) << "of 1008";
  EXPECT_TRUE(images_agree(truth, means));
  EXPECT_FALSE(images_agree(truth, scaled(means, 1.02f))) << "the test notices nothing";
}

// Only camera samples are more or fewer: splats are those of uniform sampling.
TEST(AdaptiveSampling, LeavesSplatsAsTheyAre) {
  const TestScene s = two_floors();
  RenderSettings settings = settings_for(s.scene, Integrator::kBdpt, 32, 4);
  settings.plan = SamplingPlan{};
  const Partial uniform = render_partial(s.scene, settings);
  settings.plan->allocation = random_allocation(settings.grid, 9);
  const Partial adapted = render_partial(s.scene, settings);
  EXPECT_NE(uniform.counters.camera_paths, adapted.counters.camera_paths);
  ASSERT_FALSE(uniform.splats.empty());
  EXPECT_EQ(uniform.splats, adapted.splats);
}

// Sums are exact: however sample indices are cut into tiles, the film is the same.
TEST(AdaptiveSampling, IsTheSameHoweverSamplesAreCut) {
  const TestScene s = two_floors();
  RenderSettings settings = settings_for(s.scene, Integrator::kBdpt, 21, 4);
  settings.plan = SamplingPlan{};
  settings.plan->allocation = random_allocation(settings.grid, 9);
  const Renderer renderer(s.scene, settings, 1);
  const auto workspace = renderer.make_workspace();
  const auto render = [&](int64_t begin, int64_t end) {
    PartialBuilder builder(settings.grid, {settings.grid.cells(), begin, end}, renderer.quantum_exponent(),
                           true, true);
    for (int64_t s0 = begin; s0 < end;) {
      const int64_t s1 = std::min(end, block_end(block_of_sample(s0)));
      renderer.render_packet({0, 0, s0, s1}, *workspace, builder);
      s0 = s1;
    }
    const Partial partial = builder.take();
    const PathCount paths = camera_paths_of(settings.plan->allocation, settings.grid, partial.tile);
    EXPECT_GE(partial.counters.camera_paths, paths.least);
    EXPECT_LE(partial.counters.camera_paths, paths.most);
    return partial;
  };
  Film whole(settings.grid), cut(settings.grid);
  whole.fold(render(0, 21));
  for (const auto& [begin, end] : {std::pair{13, 21}, {0, 3}, {3, 6}, {6, 7}, {7, 13}})
    cut.fold(render(begin, end));
  EXPECT_EQ(whole.resolve().data, cut.resolve().data);
  EXPECT_EQ(whole.counters().camera_paths, cut.counters().camera_paths);
}

}  // namespace
}  // namespace lightmill::test
