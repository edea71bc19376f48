#include "worker/render/plan/plan_moments.h"

#include <gtest/gtest.h>

#include "tests/support/render.h"
#include "tests/support/test_scene.h"
#include "worker/render/renderer.h"

namespace lightmill::test {
namespace {

/// A room beside which a lamp shines at nothing: what the lights' power would leave with is far more than
/// what there is, and most connections play roulette.
TestScene wasteful_room() {
  TestScene s = cornell_room().film(32, 32);
  s.quad({-1, 2, -1}, {0, 0, 2}, {2, 0, 0}, s.diffuse(0.0f), {.radiance = {2, 2, 2}});
  return s;
}

/// Shadow rays per camera path.
struct Rays {
  double next_event = 0, connect = 0, lens = 0;
};

constexpr int kSamples = 64;

/// Renders the film's one cell under `plan`; what is recorded of each sample goes to `moments`, if given.
Rays rays_under(const TestScene& s, const SamplingPlan& plan, MomentRecorder* moments) {
  RenderSettings settings = settings_for(s.scene, Integrator::kBdpt, kSamples, 5);
  settings.plan = plan;
  // Light paths that learnt not to start at that lamp would waste little.
  const Renderer unlearnt(s.scene, settings_for(s.scene, Integrator::kPt, kSamples, 5), 1);
  const Renderer renderer(unlearnt, settings);
  const auto workspace = renderer.make_workspace();
  StrategyRecorder recorder;
  double paths = 0;
  for (int64_t i = 0; i < kSamples; ++i) {
    paths += static_cast<double>(
        renderer.record_packet({0, 0, i, i + 1}, *workspace, nullptr, recorder).camera_paths);
    if (moments)
      moments->add_sample(recorder.contributions, recorder.survival_of_path, i < kSamples / 2 ? 0 : 1);
    recorder.clear();
  }
  Rays rays;
  for (size_t s_vertices = 0; s_vertices <= kRecordedVertices; ++s_vertices) {
    for (size_t t = 1; t <= kRecordedVertices; ++t) {
      const StrategyCounts& c = recorder.counts[s_vertices][t];
      const double cast = static_cast<double>(c.occluded + c.visible) / paths;
      (t == 1 ? rays.lens : s_vertices == 1 ? rays.next_event : rays.connect) += s_vertices > 0 ? cast : 0;
    }
  }
  return rays;
}

TEST(PlanMoments, KnowHowManyRaysRouletteLeavesToEveryPlan) {
  const TestScene s = wasteful_room();
  const std::vector<SamplingPlan> plans = {{kAllStrategies, 0.125, 1},
                                           {kAllStrategies, 1, 8},
                                           {kAllStrategies, 2, 0.25},
                                           {kAllStrategies, 0.25, 4},
                                           {kAllStrategies, 1, 1, 0.125}};
  const PlanSet set(plans, 1);
  MomentRecorder moments(set, 32);
  moments.begin_cell(std::array<PixelValue, kCellPixels>{});
  const Rays recorded = rays_under(s, {.connections = kRecordedConnections}, &moments);
  std::array<bool, kCellPixels> all;
  all.fill(true);
  CellMoments cell = moments.end_cell(all, all);
  for (const RecordedSplat& splat : cell.splats)
    add_splat(set, splat, PixelValue{}, 0, 1, &cell.blocks[0], &cell);
  double largest = 0;
  for (size_t k = 0; k < plans.size(); ++k) {
    const SamplingPlan& p = plans[k];
    const Rays measured = rays_under(s, p, nullptr);
    const auto expect = [&](const char* family, double predicted, double shares, double rays) {
      EXPECT_NEAR(predicted * shares / rays, 1, 0.06) << family << " of " << plan_to_json(p);
      largest = std::max(largest, std::fabs(shares - 1));
    };
    expect("next event", recorded.next_event, cell.next_event.share(k), measured.next_event);
    expect("connect", recorded.connect * p.connections / kRecordedConnections, cell.connect.share(k),
           measured.connect);
    expect("lens", recorded.lens * p.light_paths, cell.lens.share(k), measured.lens);
  }
  EXPECT_GT(largest, 0.3) << "roulette matters in this scene";
}

/// What camera paths do after event kLeastRrDepth: hits, and the squares of what each brings.
struct LatePaths {
  double hits = 0, squares = 0;
  double hits_to_save = 0, squares_to_come = 0;  // with roulette at that event
};
LatePaths late_paths(const TestScene& s, int rr_depth) {
  RenderSettings settings = settings_for(s.scene, Integrator::kPt, kSamples, 8);
  settings.plan = SamplingPlan{.strategies = kEmissionHits | kNextEvent, .rr_depth = rr_depth};
  const Renderer renderer(s.scene, settings, 1);
  const auto workspace = renderer.make_workspace();
  StrategyRecorder recorder;
  LatePaths sum;
  for (int64_t i = 0; i < kSamples; ++i) {
    recorder.clear();
    renderer.record_packet({0, 0, i, i + 1}, *workspace, nullptr, recorder);
    std::array<double, kCellPixels> brought{};
    for (const StrategyContribution& c : recorder.contributions) {
      if (c.t > kLeastRrDepth + 1) brought[static_cast<size_t>(c.slot)] += double{c.rgb[0]};
    }
    for (size_t slot = 0; slot < kCellPixels; ++slot) {
      const double square = brought[slot] * brought[slot], q = double{recorder.survival_of_path[slot]};
      sum.squares += square;
      if (square > 0) sum.squares_to_come += square / q;
    }
  }
  for (const uint32_t hits : recorder.hits_of_path) sum.hits += hits;
  sum.hits_to_save = recorder.hits_to_save;
  return sum;
}

// Recorded without roulette at an event, paths tell what it would save there, and what noise it would add.
TEST(PlanMoments, KnowWhatEarlierRouletteWouldDo) {
  TestScene s = cornell_room().film(32, 32);
  const LatePaths early = late_paths(s, kLeastRrDepth), late = late_paths(s, kMostRrDepth);
  EXPECT_EQ(early.hits_to_save, 0);
  EXPECT_GT(late.hits_to_save, 0.1 * late.hits);
  EXPECT_NEAR((late.hits - late.hits_to_save) / early.hits, 1, 0.01);
  EXPECT_GT(late.squares_to_come, 1.2 * late.squares);
  EXPECT_NEAR(late.squares_to_come / early.squares, 1, 0.05);
}

}  // namespace
}  // namespace lightmill::test
