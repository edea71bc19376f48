#include "worker/render/plan/pilot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/base/error.h"
#include "common/film/film.h"
#include "common/job/plan_text.h"
#include "tests/support/render.h"
#include "tests/support/test_scene.h"
#include "worker/render/guiding/training/emission_guide_training.h"
#include "worker/render/plan/cost_model.h"

namespace lightmill::test {
namespace {

bool always() { return true; }

PilotReport pilot_of(const TestScene& s, int max_depth = 5, int threads = 2, int64_t spp = 16) {
  return run_pilot(Renderer(s.scene, settings_for(s.scene, Integrator::kBdpt, spp, max_depth), 1), threads,
                   always, kMostPilotPaths);
}

/// A small bright lamp over a glass ball: a caustic on the floor.
TestScene caustic() {
  TestScene s;
  s.quad({-3, 0, -3}, {0, 0, 6}, {6, 0, 0}, s.diffuse(0.5f));
  s.sphere({0, 1, 0}, 0.5, s.dielectric(1.5f, 0));
  s.sphere({0.5, 4, 0.3}, 0.15, s.diffuse(0.0f), Emits{{30, 30, 30}});
  s.camera({0, 3, -6}, {0, 0.5, 0}, 40);
  return s.film(64, 64);
}

/// relMSE of one sample per pixel under `plan`, from `batches` independent renders of `spp` samples.
double measured_variance(const TestScene& s, const SamplingPlan& plan, int batches = 16, int64_t spp = 16) {
  RenderSettings settings = settings_for(s.scene, Integrator::kBdpt, spp * batches, 5);
  settings.plan = plan;
  const Batches b = render_batches(s.scene, settings, batches, 2);
  double sum = 0;
  const size_t values = b.images[0].data.size();
  for (size_t k = 0; k < values; ++k) {
    double mean = 0, squares = 0;
    for (const Image& image : b.images) {
      const auto x = static_cast<double>(image.data[k]);
      mean += x / batches, squares += x * x;
    }
    sum +=
        (squares - batches * mean * mean) / (batches - 1) * static_cast<double>(spp) / (mean * mean + 0.01);
  }
  return sum / static_cast<double>(values);
}

struct PlanNoise {
  std::string plan;
  double predicted, measured;
};
/// Of estimates that `counts` says; plans are rendered with the same random numbers.
template <class Counts>
std::vector<PlanNoise> noise_of_plans(const TestScene& s, Counts&& counts, int batches = 16) {
  std::vector<PlanNoise> noise;
  for (const PlanEstimate& e : pilot_of(s).estimates) {
    if (counts(e.plan))
      noise.push_back({plan_to_json(e.plan), e.relative_variance, measured_variance(s, e.plan, batches)});
  }
  return noise;
}
bool has_few(const SamplingPlan& p) { return p.light_paths == 0.25 && p.connections == 0.25; }
bool has_many(const SamplingPlan& p) { return p.light_paths == 1 && p.connections == 2; }

// Against renders of the plans themselves: ratios between plans within 40 % of their median, which lies near
// one.
TEST(Pilot, PredictsTheNoiseOfPlans) {
  const std::vector<PlanNoise> noise = noise_of_plans(cornell_room().film(64, 64), [](const SamplingPlan& p) {
    return has_few(p) || has_many(p) || p.strategies == (kEmissionHits | kNextEvent);
  });
  ASSERT_GE(noise.size(), 3u);
  std::vector<double> sorted;
  for (const PlanNoise& n : noise) sorted.push_back(n.predicted / n.measured);
  std::sort(sorted.begin(), sorted.end());
  const double median = sorted[sorted.size() / 2];
  EXPECT_GT(median, 0.8);
  EXPECT_LT(median, 1.25);
  for (const PlanNoise& n : noise)
    EXPECT_NEAR(std::log(n.predicted / n.measured / median), 0, std::log(1.4)) << n.plan;
}

// Of images of these sizes a pilot sees some pixels, and predicts the same of all. In the balls the lamp is
// seen by reflections that are rare and bright, though never brighter than the lamp: what all plans share of
// that must not hide what light paths and connections gain.
TEST(Pilot, PredictsTheNoiseOfPlansBySomePixels) {
  TestScene s = cornell_room();
  s.sphere({-0.3, -0.4, 0.3}, 0.5, s.dielectric(1.5f, 0)).sphere({0.5, 0.1, 0.6}, 0.3, s.dielectric(1.5f, 0));
  const auto some = [](const SamplingPlan& p) {
    const bool few = p.strategies == kAllStrategies && has_few(p);
    return few || (p.light_tracing_weight == 1 &&
                   ((p.strategies == kAllStrategies && has_many(p)) ||
                    (p.light_paths == 0.125 && p.strategies == (kAllStrategies & ~kVertexConnections))));
  };
  const std::vector<PlanNoise> noise = noise_of_plans(s.film(240, 240), some, 12);
  ASSERT_EQ(noise.size(), 5u);
  double mean = 0;
  for (const PlanNoise& n : noise) mean += std::log(n.predicted / n.measured) / 5;
  EXPECT_NEAR(mean, 0, std::log(1.35));
  for (const PlanNoise& n : noise)
    EXPECT_NEAR(std::log(n.predicted / n.measured), mean, std::log(1.25))
        << n.plan << n.predicted << " for " << n.measured;
  for (const int size : {480, 960}) {
    SCOPED_TRACE(size);
    size_t k = 0;
    for (const PlanEstimate& e : pilot_of(s.film(size, size)).estimates) {
      if (!some(e.plan)) continue;
      ASSERT_LT(k, noise.size());
      EXPECT_EQ(plan_to_json(e.plan), noise[k].plan);
      EXPECT_NEAR(std::log(e.relative_variance / noise[k].predicted), 0, std::log(1.2)) << noise[k].plan;
      ++k;
    }
  }
}

// A pilot has eight samples at some pixels of the edges of visible lamps. Light tracing tells which part of
// each a lamp covers, and plans without it are not taken to be noisy there.
TEST(Pilot, PredictsHowLittleNoiseIsAtEdgesOfLamps) {
  TestScene s;
  s.quad({-4, -4, 4}, {0, 8, 0}, {8, 0, 0}, s.diffuse(0.5f));
  s.quad({-4, -2, 0}, {0, 0, 4}, {8, 0, 0}, s.diffuse(0.5f));
  for (int i = 0; i < 6; ++i) {
    const int column = i % 3, row = i / 3;
    const double x = 0.9 * column - 1.1, y = 0.7 * row + 0.1, turn = 0.04 * i;
    s.quad({x, y, 3}, {-turn, 0.3, 0}, {0.4, turn, 0}, s.diffuse(0.0f), {.radiance = {10, 10, 10}});
  }
  s.camera({0, 0, 0}, {0, 0, 1}, 60);
  const auto some = [](const SamplingPlan& p) {
    return p.connections == 1 && (p.strategies & kVertexConnections) && p.light_paths == 0.25;
  };
  const std::vector<PlanNoise> noise = noise_of_plans(s.film(240, 240), some, 8);
  ASSERT_EQ(noise.size(), 4u);
  for (const PlanNoise& n : noise)
    EXPECT_NEAR(std::log(n.predicted / n.measured), 0, std::log(1.8))
        << n.plan << n.predicted << " for " << n.measured;
}

// The filter spreads lamps in sight over pixels that they do not cover: there hits find them rarely, and are
// far brighter than what is on average. Light paths are predicted to be noisier than they are: as many as are
// its due leave each lamp, which the pilot takes for chance.
TEST(Pilot, KnowsThatAFilterSpreadsLampsInSight) {
  TestScene s;
  for (int i = 0; i < 120; ++i) {
    const auto part = [&](double step) { return std::fmod(i * step, 1.0); };
    s.sphere({4 * part(0.618) - 2, 2 * part(0.755) - 0.6, 3 + 2 * part(0.57)}, 0.01 + 0.04 * part(0.41),
             s.diffuse(0.0f), Emits{{30, 20, 10}});
  }
  s.camera({0, 0.5, -1}, {0, 0.5, 0}, 50).film(96, 72);
  s.scene.filter = FilterDescription{};  // gaussian of radius 1.5
  const std::vector<PlanNoise> noise = noise_of_plans(s, [](const SamplingPlan& p) {
    return (p.strategies & (kNextEvent | kVertexConnections)) == kNextEvent && p.light_tracing_weight == 1;
  });
  ASSERT_EQ(noise.size(), 6u);
  for (const PlanNoise& n : noise) {
    const bool light_paths = n.plan.find("light-tracing") != std::string::npos;
    EXPECT_GT(n.predicted / n.measured, light_paths ? 1 : 1 / 1.5) << n.plan;
    EXPECT_LT(n.predicted / n.measured, light_paths ? 3 : 1.5) << n.plan;
  }
}

// In a caustic most of the noise is the lamp met by way of the floor and the glass: so rarely that a pilot
// may not see it, and by the same paths whatever the plan. What plans differ in is predicted.
TEST(Pilot, PredictsWhatPlansDifferInWhereRarePathsMakeTheNoise) {
  const auto all = [](const SamplingPlan& p) {
    return (has_few(p) || has_many(p)) && p.light_tracing_weight == 1 &&
           p.strategies == (kEmissionHits | kNextEvent | kVertexConnections | kLightTracing);
  };
  const std::vector<PlanNoise> noise = noise_of_plans(caustic(), all);
  ASSERT_EQ(noise.size(), 2u);
  const double predicted = noise[0].predicted - noise[1].predicted,
               measured = noise[0].measured - noise[1].measured;
  EXPECT_GT(std::fabs(measured), 0.001);
  EXPECT_NEAR(predicted / measured, 1, 0.4) << predicted << " for " << measured;
}

// The upper edge of a lamp reaches a thousandth into a row of pixels: one of a pilot's camera samples meets
// it, or none, but light paths do, and a plan without these is known to be noisy there.
TEST(Pilot, SeesSliversOfALampThatItsCameraSamplesMiss) {
  constexpr double kSliver = 1.0 / 1000, kRadiance = 10;
  constexpr int kWidth = 60, kSize = 64;
  TestScene s;
  const double pixel = 2.0 * 4 / kSize;  // at the lamp
  s.quad({-pixel * kWidth / 2, 0, 4}, {0, pixel * (1 + kSliver), 0}, {pixel * kWidth, 0, 0}, s.diffuse(0.0f),
         {.radiance = {kRadiance, kRadiance, kRadiance}});
  s.quad({-30, -30, -1}, {60, 0, 0}, {0, 60, 0}, s.diffuse(0.001f));
  s.camera({0, 0, 0}, {0, 0, 1}, 90).film(kSize, kSize);
  const double mean = kRadiance * kSliver,
               variance = kRadiance * kRadiance * kSliver * (1 - kSliver) / (mean * mean + 0.01),
               expected = variance * kWidth / (kSize * kSize);
  for (const uint64_t seed : {1, 2, 3, 4, 5, 6}) {
    RenderSettings settings = settings_for(s.scene, Integrator::kBdpt, 16, 5);
    settings.seed = seed;
    const PilotReport report = run_pilot(Renderer(s.scene, settings, 1), 2, always, kMostPilotPaths);
    bool found = false;
    for (const PlanEstimate& e : report.estimates) {
      if (e.plan.strategies != (kEmissionHits | kNextEvent)) continue;
      found = true;
      EXPECT_NEAR(e.relative_variance / expected, 1, 0.4) << "seed " << seed;
    }
    EXPECT_TRUE(found);
  }
}

// A floor under a sky and a lamp, both sampled everywhere: the squared mean of the samples is a hundred times
// their variance. Little of that may be lost in the difference, and the allocation must not follow what is
// left of it.
TEST(Pilot, KnowsLittleNoise) {
  TestScene s;
  s.quad({-9, 0, -9}, {0, 0, 18}, {18, 0, 0}, s.diffuse(0.6f));
  s.environment({1, 1, 1});
  s.point_light({1, 4, 1}, {30, 30, 30});
  s.camera({0, 6, 0.01}, {0, 0, 0}, 40).film(64, 64);
  const PilotReport report = pilot_of(s);
  const SamplingPlan pt{kEmissionHits | kNextEvent};
  for (const PlanEstimate& e : report.estimates) {
    if (e.plan.strategies != pt.strategies) continue;
    const double measured = measured_variance(s, pt);
    EXPECT_LT(measured, 0.05);
    EXPECT_NEAR(std::log(e.relative_variance / measured), 0, std::log(1.4)) << measured;
  }
  EXPECT_EQ(report.chosen.strategies, pt.strategies);
  EXPECT_TRUE(report.chosen.allocation.uniform());
}

TEST(Pilot, IsTheSameForAnyThreads) {
  const TestScene s = cornell_room().film(70, 40);
  const std::string one = pilot_to_json(pilot_of(s, 5, 1, 4));
  EXPECT_EQ(one, pilot_to_json(pilot_of(s, 5, 3, 4)));
}

TEST(Pilot, ChoosesLightPathsForACaustic) {
  const PilotReport report = pilot_of(caustic());
  EXPECT_TRUE(report.chosen.strategies & kLightTracing) << plan_to_json(report.chosen);
}

// The emission guide makes light paths more even and longer: through a door that pays, in an open box that is
// lit all over it does not.
TEST(Pilot, GuidesLightPathsThroughADoor) {
  TestScene s;
  const int grey = s.diffuse(0.75f);
  s.box({-3, -0.1, -4}, {3, 0, 4}, grey).box({-3, 3, -4}, {3, 3.1, 4}, grey);
  s.box({-3.1, 0, -4}, {-3, 3, 4}, s.diffuse({0.7f, 0.2f, 0.15f}));
  s.box({3, 0, -4}, {3.1, 3, 4}, s.diffuse({0.2f, 0.6f, 0.25f}));
  s.box({-3, 0, 4}, {3, 3, 4.1}, grey).box({-3, 0, -4.1}, {3, 3, -4}, grey);
  s.box({-3, 0, 0}, {-0.5, 3, 0.1}, grey).box({0, 0, 0}, {3, 3, 0.1}, grey);
  s.box({-0.5, 2.2, 0}, {0, 3, 0.1}, grey);
  s.quad({-2.4, 2.95, 0.6}, {0.6, 0, 0}, {0, 0, 0.6}, s.diffuse(0.0f), {.radiance = {30, 28, 24}});
  s.camera({0, 1.5, -3.8}, {0, 1.3, 0}, 60).film(128, 96);
  const Renderer renderer(s.scene, settings_for(s.scene, Integrator::kBdpt, 16, 8), 2);
  const PilotReport report = run_pilot(renderer, 2, always, kMostPilotPaths);
  EXPECT_TRUE(uses_emission_guide(renderer.context().scene, report.chosen, report.chosen.strategies))
      << plan_to_json(report.chosen);
}
TEST(Pilot, DoesNotGuideLightPathsOfALampThatLightsAll) {
  TestScene s;
  const int white = s.diffuse(0.72f);
  s.quad({-1, -1, -1}, {0, 0, 2}, {2, 0, 0}, white).quad({-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, white);
  s.quad({-1, -1, 1}, {0, 2, 0}, {2, 0, 0}, white);
  s.quad({-1, -1, -1}, {0, 2, 0}, {0, 0, 2}, s.diffuse({0.6f, 0.05f, 0.05f}));
  s.quad({1, -1, -1}, {0, 0, 2}, {0, 2, 0}, s.diffuse({0.1f, 0.5f, 0.1f}));
  s.box({0.1, -1, -0.6}, {0.6, -0.4, -0.1}, white).box({-0.6, -1, 0.1}, {-0.1, 0.2, 0.6}, white);
  s.quad({-0.25, 0.98, -0.2}, {0.5, 0, 0}, {0, 0, 0.4}, s.diffuse(0.0f), {.radiance = {17, 12, 4}});
  s.camera({0, 0, -3.9}, {0, 0, 0}, 39).film(96, 96);
  const PilotReport report = pilot_of(s, 8);
  ASSERT_NE(report.emission_guide_gain, 1) << "no aims were learnt, or all at once";
  ASSERT_FALSE(report.chosen.guided_emission.value_or(true)) << plan_to_json(report.chosen);
  for (const PlanEstimate& e : report.estimates)
    EXPECT_EQ(e.plan.guided_emission.has_value(), (e.plan.strategies & kLightPaths) != 0)
        << plan_to_json(e.plan);
}

/// Blocks on a floor, under a sky.
TestScene blocks_under_a_sky() {
  TestScene s;
  const int grey = s.diffuse(0.6f);
  s.quad({-9, 0, -9}, {0, 0, 18}, {18, 0, 0}, grey);
  for (int i = 0; i < 4; ++i) s.box({i - 2.0, 0, 0}, {i - 1.4, 1, 0.6}, grey);
  s.environment({1, 1, 1});
  s.camera({0, 2, -5}, {0, 0.5, 0}, 50);
  return s.film(64, 64);
}

// Under a sky few paths go on for long, and roulette makes a good part of the noise. In a dark closed room
// all go on, and bring next to nothing.
TEST(Pilot, ChoosesWhereRouletteBegins) {
  const PilotReport open = pilot_of(blocks_under_a_sky(), 8);
  EXPECT_EQ(open.chosen.rr_depth, kMostRrDepth);
  EXPECT_NE(plan_text(open.chosen).find("roulette from event 3 on"), std::string::npos);
  TestScene room;
  room.box({-1, -1, -1}, {1, 1, 1}, room.diffuse(0.2f)).point_light({0.5, 0, 0.9}, {2, 2, 2});
  room.camera({0, 0, -0.9}, {0, -0.3, 1}, 70).film(64, 64);
  EXPECT_EQ(pilot_of(room, 30).chosen.rr_depth, kLeastRrDepth);
}

// The more samples, the less noise a sample is predicted to have, as it has: to within a factor of 1.6. Under
// the sky it falls by half.
TEST(Pilot, PredictsHowTheNoiseFallsWithSamples) {
  for (const bool sky : {true, false}) {
    const TestScene s = sky ? blocks_under_a_sky() : cornell_room().film(64, 64);
    double first = 0, last = 0;
    for (const int64_t spp : {64, 256, 1024}) {
      const PilotReport report = pilot_of(s, 5, 2, spp);
      for (const PlanEstimate& e : report.estimates) {
        if (e.plan.strategies != (kEmissionHits | kNextEvent)) continue;
        const double measured = measured_variance(s, e.plan, 3, spp);
        EXPECT_NEAR(std::log(e.relative_variance / measured), 0, std::log(1.6))
            << spp << " spp: " << e.relative_variance << " for " << measured;
        (spp == 64 ? first : last) = measured;
      }
    }
    EXPECT_GT(first / last, sky ? 1.4 : 1);
  }
}

// Of the chosen roulette, as of all else.
TEST(Pilot, PredictsTheNoiseUnderASky) {
  const std::vector<PlanNoise> noise = noise_of_plans(blocks_under_a_sky(), [](const SamplingPlan& p) {
    return p.strategies == (kEmissionHits | kNextEvent) || p.strategies == kEmissionHits;
  });
  ASSERT_EQ(noise.size(), 2u);
  for (const PlanNoise& n : noise)
    EXPECT_NEAR(std::log(n.predicted / n.measured), 0, std::log(1.4)) << n.plan;
}

TEST(Pilot, LeavesLightPathsOutUnderAnOpenSky) {
  TestScene s;
  s.quad({-3, 0, -3}, {0, 0, 6}, {6, 0, 0}, s.diffuse({0.6f, 0.5f, 0.3f}));
  s.environment({1, 1, 1});
  s.camera({0, 6, 0.01}, {0, 0, 0}, 40).film(64, 64);
  const PilotReport report = pilot_of(s);
  EXPECT_FALSE(report.chosen.strategies & kLightPaths) << plan_to_json(report.chosen);
}

// What a point light sends through glass is only found by light paths: no plan may leave them out, however
// little light that is.
TEST(Pilot, KeepsWhatAloneSeesALight) {
  TestScene s;
  s.quad({-3, 0, -3}, {0, 0, 6}, {6, 0, 0}, s.diffuse(0.5f));
  s.sphere({0, 1, 0}, 0.1, s.dielectric(1.5f, 0));
  s.point_light({0, 3, 0}, {10, 10, 10});
  s.camera({0, 6, 0.01}, {0, 0, 0}, 60).film(64, 64);
  const PilotReport report = pilot_of(s);
  for (const PlanEstimate& e : report.estimates)
    EXPECT_EQ(e.plan.strategies, kNextEvent | kLightPaths) << plan_to_json(e.plan);
  ASSERT_FALSE(report.estimates.empty());
}

TEST(Pilot, HasAnAnswerForEveryScene) {
  TestScene dark;
  dark.quad({-3, 0, -3}, {0, 0, 6}, {6, 0, 0}, dark.diffuse(0.5f));
  dark.camera({0, 6, 0.01}, {0, 0, 0}, 60).film(8, 8);
  EXPECT_NO_THROW(check_plan(pilot_of(dark).chosen));
  const PilotReport emitters = pilot_of(cornell_room().film(8, 8), 0);
  EXPECT_EQ(emitters.chosen.strategies, kEmissionHits);
  EXPECT_NO_THROW(check_plan(pilot_of(cornell_room().film(1, 1), 1).chosen));
}

TEST(Pilot, StopsWhenAsked) {
  const TestScene s = cornell_room();
  const Renderer renderer(s.scene, settings_for(s.scene, Integrator::kBdpt, 4, 5), 1);
  EXPECT_THROW(run_pilot(renderer, 2, [] { return false; }), Error);
}

TEST(CostModel, ChargesForWhatRuns) {
  SampleWork work{3, 3, 1, 2, 1, 1000, 2, 4, 2};
  const auto cost = [&](Strategies set, double light_paths, double connections) {
    return sample_cost(work, {set, light_paths, connections});
  };
  const Strategies pt = kEmissionHits | kNextEvent;
  EXPECT_LT(cost(kEmissionHits, 1, 1), cost(pt, 1, 1));
  EXPECT_EQ(cost(pt, 0.25, 0.25), cost(pt, 2, 4));
  EXPECT_LT(cost(pt, 1, 1), cost(pt | kLightTracing, 0.25, 1));
  EXPECT_LT(cost(pt | kLightTracing, 0.25, 1), cost(pt | kLightTracing, 1, 1));
  EXPECT_LT(cost(kAllStrategies, 0.25, 1), cost(kAllStrategies, 0.25, 2));
  const double few = cost(kAllStrategies, 1, 1);
  work.primitives = 1e6;
  EXPECT_LT(few, cost(kAllStrategies, 1, 1));
  const double without = cost(pt, 1, 1), without_light = cost(kAllStrategies, 1, 1) - without;
  work.camera_steps = 5;
  EXPECT_LT(without, cost(pt, 1, 1));
  const double camera_steps = cost(kAllStrategies, 1, 1) - cost(pt, 1, 1);
  EXPECT_NEAR(camera_steps, without_light, 1e-9);
  work.light_steps = 5;
  EXPECT_LT(camera_steps, cost(kAllStrategies, 1, 1) - cost(pt, 1, 1));
}

// Walks through bodies are work, where a body is in sight or lit.
TEST(Pilot, CountsStepsThroughBodies) {
  const auto work_of = [](bool body) {
    TestScene s = cornell_room();
    SubsurfaceMaterial milk;
    milk.sigma_s = {20, 20, 20};
    milk.sigma_a = {0.1f, 0.1f, 0.1f};
    s.scene.materials.push_back({"", milk, {}});
    s.sphere({0, 0, 0}, 0.5, body ? static_cast<int>(s.scene.materials.size()) - 1 : s.diffuse(0.8f));
    return pilot_of(s.film(48, 48)).work;
  };
  const SampleWork with = work_of(true), without = work_of(false);
  EXPECT_GT(with.camera_steps, with.camera_hits);
  EXPECT_GT(with.light_steps, 0.1);
  EXPECT_EQ(without.camera_steps, 0);
  EXPECT_EQ(without.light_steps, 0);
}

}  // namespace
}  // namespace lightmill::test
