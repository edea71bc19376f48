// Light that no path meets is told of, as much as there is.
#include "worker/render/guiding/training/missing_light.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "tests/support/render.h"
#include "tests/support/test_scene.h"
#include "worker/render/pipeline/recording/strategy_recorder.h"
#include "worker/render/renderer.h"

namespace lightmill::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

/// A lamp that shines up into a mirror, a screen below it; the camera sees the floor in a mirror on a wall.
/// Light comes to the floor by the mirror above, and by way of the wall beside it.
TestScene lit_and_seen_by_mirrors(int film) {
  TestScene s;
  s.quad({-1, 1.5, -1}, {2, 0, 0}, {0, 0, 2}, s.conductor(0.95f, 0));
  s.quad({-1, 0, 1.2}, {0, 2, 0}, {2, 0, 0}, s.conductor(0.9f, 0));
  s.quad({-1, 0, -1}, {0, 1.5, 0}, {0, 0, 2.2}, s.diffuse(0.6f));
  s.quad({-0.3, 0.98, -0.3}, {0, 0, 0.6}, {0.6, 0, 0}, s.diffuse(0));
  // Walks would find it (manifold_training_test.cc): panes keep them away.
  s.quad({0.9, 0.01, -0.95}, {0, 0, 0.05}, {0.05, 0, 0}, s.thin_dielectric(1.5f));
  s.camera({0, 1.2, -0.95}, {0, 0.4, 1.2}, 8).film(film, film);
  return s;
}
void add_seen_floor(int material, TestScene* s) { s->quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, material); }
void add_lamp(double half, TestScene* s) {
  const auto radiance = static_cast<float>(1 / (half * half));
  s->quad({-half, 1, -half}, {0, 0, 2 * half}, {2 * half, 0, 0}, s->diffuse(0),
          {.radiance = {radiance, radiance, radiance}});
}
Renderer renderer_to_depth(const TestScene& s, int max_depth = 8, int threads = 1) {
  return {s.scene, settings_for(s.scene, Integrator::kAuto, 16, max_depth), threads};
}

// Deeper paths may have more than one surface between mirrors, which the preview pass leaves out.
constexpr int kDepth = 4;

TEST(MissingLight, IsAllThatCameraPathsAloneBring) {
  TestScene s = lit_and_seen_by_mirrors(64);
  add_seen_floor(s.diffuse(0.7f), &s);
  add_lamp(0.1, &s);
  const Renderer renderer = renderer_to_depth(s, kDepth);
  const MissingShare missing = estimate_missing_light(renderer.context(), 1).up_to(kDepth);
  const auto mean = [&](Strategies strategies) {
    RenderSettings settings = settings_for(s.scene, Integrator::kBdpt, 128, kDepth);
    settings.plan = SamplingPlan{.strategies = strategies};
    return render_batches(s.scene, settings, 8).mean();
  };
  const Estimate all = mean(kAllStrategies), joined = mean(kAllStrategies & ~kEmissionHits);
  ASSERT_GT(all.mean, 1.5 * joined.mean);
  EXPECT_NEAR(missing.all, 1 - joined.mean / all.mean, 0.06);
  EXPECT_EQ(missing.never, 0);
  EXPECT_LT(missing.seldom, 0.01) << "there is a guide, and it is large";
  EXPECT_EQ(renderer.plan().missing_light, "");
}

TEST(MissingLight, CountsTheMeetingsAndTheirNoise) {
  TestScene s = lit_and_seen_by_mirrors(32);
  add_seen_floor(s.coated({0.7f, 0.7f, 0.7f}, 1.3f, 0), &s);  // of no kind that is guided
  add_lamp(0.05, &s);
  // Without an emission guide, which is learnt after the preview pass.
  const Renderer renderer(s.scene, settings_for(s.scene, Integrator::kPt, 16, kDepth), 1);
  const MissingLight preview = estimate_missing_light(renderer.context(), 1);
  const MissingShare missing = preview.up_to(kDepth);
  EXPECT_NEAR(missing.seldom, missing.all, 0.02 * missing.all);
  EXPECT_THAT(renderer.plan().missing_light, HasSubstr("so small that one camera path in"));

  RenderSettings settings = settings_for(s.scene, Integrator::kBdpt, 4096, kDepth);
  settings.plan = SamplingPlan{.strategies = kEmissionHits};
  const Renderer hits(s.scene, settings, 1);
  const auto workspace = hits.make_workspace();
  const auto recorder = std::make_unique<StrategyRecorder>();
  double met = 0, squares = 0, paths = 0;
  const CellRect cells = settings.grid.cells();
  for (int y = cells.y0; y < cells.y1; ++y) {
    for (int x = cells.x0; x < cells.x1; ++x) {
      for (int64_t sample = 0; sample < settings.spp; sample += kSuperblockSamples) {
        paths += static_cast<double>(
            hits.record_packet({x, y, sample, sample + kSuperblockSamples}, *workspace, nullptr, *recorder)
                .camera_paths);
        met += static_cast<double>(recorder->contributions.size());
        for (const StrategyContribution& c : recorder->contributions)
          squares += std::pow(double{c.rgb[0] + c.rgb[1] + c.rgb[2]} / 3, 2);
        recorder->clear();
      }
    }
  }
  ASSERT_GT(met, 300);
  // Photons are blurred, which says a fifth too much here, whatever the seed.
  EXPECT_NEAR(missing.emitter_hits, met / paths, 0.3 * met / paths);
  const double noise = squares / paths / (preview.image * preview.image);
  EXPECT_LT(missing.noise, noise) << "without that of roulette";
  EXPECT_GT(missing.noise, 0.4 * noise);
}

// A light at a point is as a lamp that is too small to be met.
TEST(MissingLight, OfLightsAtAPointIsNeverMet) {
  TestScene point = lit_and_seen_by_mirrors(32), lamp = point;
  for (TestScene* s : {&point, &lamp}) add_seen_floor(s->diffuse(0.7f), s);
  point.point_light({0, 1, 0}, {2, 2, 2});
  constexpr double kRadius = 1e-5;
  constexpr auto kRadiance = static_cast<float>(2 / (M_PI * kRadius * kRadius));
  lamp.sphere({0, 1, 0}, kRadius, lamp.diffuse(0), {.radiance = {kRadiance, kRadiance, kRadiance}});
  const Renderer of_point = renderer_to_depth(point), of_lamp = renderer_to_depth(lamp);
  EXPECT_GT(of_point.plan().missing.never, 0.3);
  // Over seeds 0.577 +- 0.008 and 0.543 +- 0.017.
  EXPECT_NEAR(of_point.plan().missing.never, of_lamp.plan().missing.seldom, 0.1);
  EXPECT_EQ(of_point.plan().missing.seldom, 0);
  EXPECT_EQ(of_lamp.plan().missing.never, 0);
  EXPECT_THAT(of_point.plan().missing_light, HasSubstr("at a point or far away, which no path meets"));
  EXPECT_THAT(of_lamp.plan().missing_light, HasSubstr("so small that"));
  EXPECT_EQ(of_point.warnings(), std::vector<std::string>{"warning: " + of_point.plan().missing_light});
  EXPECT_EQ(of_point.missing_light(), std::vector<std::string>{of_point.plan().missing_light});

  // A mirror, the floor, a mirror: three events.
  EXPECT_EQ(renderer_to_depth(point, 2).plan().missing_light, "");
  EXPECT_NE(renderer_to_depth(point, 3).plan().missing_light, "");
  EXPECT_EQ(renderer_to_depth(point, 8, 3).plan().missing.never, of_point.plan().missing.never);
}

TEST(MissingLight, IsSaidInOneLine) {
  EXPECT_EQ(missing_light_text({.all = 0.5, .never = 0.004, .seldom = 0.004, .emitter_hits = 1e-9}), "");
  EXPECT_THAT(missing_light_text({.all = 0.5, .never = 0.006, .seldom = 0.006, .emitter_hits = 1e-9}),
              AllOf(StartsWith("about 1.2 %"), HasSubstr("no path meets, and so small"),
                    HasSubstr("one camera path in 1e+09")));
  EXPECT_THAT(missing_light_text({.never = 0.25}),
              AllOf(StartsWith("about 25 %"), HasSubstr("no path meets;"), Not(HasSubstr("so small"))));
}

TEST(MissingLight, IsNoneWhereSomethingCanBeJoined) {
  TestScene s = lit_and_seen_by_mirrors(32);
  add_seen_floor(s.diffuse(0.7f), &s);
  s.point_light({0, 1, 0}, {2, 2, 2});
  s.camera({0, 1.2, -0.95}, {0, 0, 0.2}, 20);  // straight at the floor: light paths bring it
  EXPECT_LT(renderer_to_depth(s).plan().missing.all, 1e-3);
  EXPECT_EQ(renderer_to_depth(cornell_room()).plan().missing.all, 0);
  TestScene dark = lit_and_seen_by_mirrors(32);
  add_seen_floor(dark.diffuse(0), &dark);
  dark.scene.materials[static_cast<size_t>(dark.scene.shapes[2].material)] = dark.scene.materials.back();
  dark.point_light({0, 1, 0}, {2, 2, 2});
  EXPECT_EQ(renderer_to_depth(dark).plan().missing.all, 0) << "nothing over nothing";
}

}  // namespace
}  // namespace lightmill::test
