// Where light is missing that walks bring, they do, all of it and once.
#include "worker/render/guiding/training/manifold_training.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/render.h"
#include "tests/support/test_scene.h"
#include "worker/render/plan/pilot.h"
#include "worker/render/renderer.h"

namespace lightmill::test {
namespace {

constexpr float kMirror = 0.9999f;

void add_floor(int material, TestScene* s) { s->quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, material); }
/// A shade around (0, y, 0) that is open above or below.
void add_shade(double y, double open, TestScene* s) {
  constexpr double kHalf = 0.05, kDeep = 0.02;
  const int black = s->diffuse(0);
  const double shut = y - std::copysign(kDeep, open), height = y + open - shut;
  s->quad({-kHalf, shut, -kHalf}, {0, 0, 2 * kHalf}, {2 * kHalf, 0, 0}, black);
  for (const double side : {-kHalf, kHalf}) {
    s->quad({side, shut, -kHalf}, {0, 0, 2 * kHalf}, {0, height, 0}, black);
    s->quad({-kHalf, shut, side}, {2 * kHalf, 0, 0}, {0, height, 0}, black);
  }
}
/// The light comes to the floor off a mirror above, and the floor is seen in a mirror on a wall.
TestScene mirrors(TestScene s, int film) {
  s.quad({-1, 1.5, -1}, {2, 0, 0}, {0, 0, 2}, s.conductor(kMirror, 0));
  s.quad({-1, 0, 1.2}, {0, 2, 0}, {2, 0, 0}, s.conductor(kMirror, 0));
  s.camera({0, 1.2, -0.95}, {0, 0.4, 1.2}, 8).film(film, film);
  return s;
}
/// Light and camera where the mirrors show them.
TestScene unfolded(TestScene s, int film) {
  s.camera({0, 1.2, 3.35}, {0, 0.4, 1.2}, 8).film(film, film);
  return s;
}
/// A light at a point in a shade.
TestScene shaded_light(int film) {
  TestScene s;
  add_floor(s.diffuse(0.7f), &s);
  add_shade(1, 0.1, &s);
  s.point_light({0, 1, 0}, {2, 1, 2});
  return mirrors(s, film);
}
Renderer renderer_with_seeds(const TestScene& s, int threads = 1) {
  return {s.scene, settings_for(s.scene, Integrator::kBdpt, 16, 8), threads};
}
bool walks(const Renderer& r) {
  const auto& items = r.plan().items;
  return std::find_if(items.begin(), items.end(),
                      [](const PlanItem& i) { return i.feature == "manifold next event"; })
      ->needed;
}

TEST(Manifolds, ShowALightAtAPointInMirrors) {
  TestScene base;
  add_floor(base.diffuse(0.7f), &base);
  add_shade(1, 0.1, &base);
  TestScene folded = mirrors(base, 32), plain = unfolded(base, 32);
  add_shade(2, -0.1, &plain);
  folded.point_light({0, 1, 0}, {2, 2, 2});
  plain.point_light({0, 2, 0}, {2, 2, 2});
  EXPECT_TRUE(walks(renderer_with_seeds(folded)));
  EXPECT_EQ(renderer_with_seeds(folded).plan().missing_light, "");
  EXPECT_FALSE(walks(renderer_with_seeds(plain)));
  // Quarters of the image, which is mirrored.
  for (const Integrator integrator : {Integrator::kBdpt, Integrator::kPt}) {
    const Batches a = render_batches(folded.scene, settings_for(folded.scene, integrator, 128, 3), 8),
                  b = render_batches(plain.scene, settings_for(plain.scene, Integrator::kPt, 128, 1), 8);
    for (const int y : {0, 16}) {
      for (const int x : {0, 16}) {
        const Estimate seen = a.mean(PixelRect{x, y, x + 16, y + 16}),
                       expected = b.mean(PixelRect{16 - x, y, 32 - x, y + 16});
        ASSERT_GT(expected.mean, 0.01);
        EXPECT_NEAR(seen.mean, expected.mean, 0.005 * expected.mean)
            << name_of(integrator) << " " << x << " " << y;
      }
    }
  }
  // A mirror, the floor, a mirror: with two events there is nothing.
  EXPECT_EQ(render_batches(folded.scene, settings_for(folded.scene, Integrator::kBdpt, 32, 2), 2).mean().mean,
            0);
}

// What a ball of glass around a light reflects back to its centre leaves it on the other side, by a way of
// other events that comes from the same direction: glass takes no light away.
TEST(Manifolds, ShowALightInsideGlass) {
  TestScene bare;
  add_floor(bare.diffuse(0.7f), &bare);
  bare.point_light({0, 1, 0}, {2, 2, 2});
  bare.camera({0, 1.2, -0.95}, {0, 0, 0.2}, 8).film(32, 32);
  bare.box({-0.1, 1.05, -0.9}, {0.1, 1.25, -0.88}, bare.dielectric(1.5f, 0));  // to look through
  TestScene inside = bare;
  inside.sphere({0, 1, 0}, 0.05, inside.dielectric(2, 0));  // reflects 1/9
  const Renderer renderer = renderer_with_seeds(inside);
  ASSERT_TRUE(walks(renderer));
  EXPECT_GT(renderer.context().scene.manifolds.found, 0.98);
  const auto mean = [](const TestScene& s, int max_depth) {
    return render_batches(s.scene, settings_for(s.scene, Integrator::kPt, 128, max_depth), 8).mean().mean;
  };
  // Depths: two faces, the floor, and a further one per event.
  const double expected = mean(bare, 3);
  ASSERT_GT(expected, 0.01);
  EXPECT_NEAR(mean(inside, 4), expected * 8 / 9, 0.003 * expected);
  EXPECT_NEAR(mean(inside, 5), expected * 80 / 81, 0.01 * expected) << "cells of few photons lack some";
}

/// A lamp that shines up, of one power.
TestScene with_lamp(TestScene s, double half) {
  const auto radiance = static_cast<float>(1 / (half * half));
  s.quad({-half, 1, -half}, {0, 0, 2 * half}, {2 * half, 0, 0}, s.diffuse(0),
         {.radiance = {radiance, radiance, radiance}});
  return s;
}

// What camera paths meet and what walks find is the same light: it counts once. Walks leave scenes with panes
// alone.
TEST(Manifolds, CountWhatIsMetOnce) {
  TestScene base;
  add_floor(base.conductor(0.7f, 0.5f), &base);                   // of no kind that is guided
  const TestScene by_walks = with_lamp(mirrors(base, 32), 0.06);  // met seldom
  TestScene by_meeting = by_walks;
  by_meeting.quad({-1, 5, -1}, {0, 0, 1}, {1, 0, 0}, by_meeting.thin_dielectric(1.5f));
  EXPECT_TRUE(walks(renderer_with_seeds(by_walks)));
  EXPECT_FALSE(walks(renderer_with_seeds(by_meeting)));
  const auto mean = [](const TestScene& s, int64_t spp) {
    return render_batches(s.scene, settings_for(s.scene, Integrator::kBdpt, spp, 8), 8).mean();
  };
  const Estimate walked = mean(by_walks, 1024), met = mean(by_meeting, 4096);
  ASSERT_LT(met.standard_error, 0.03 * met.mean);
  EXPECT_LT(walked.standard_error, 0.75 * met.standard_error) << "of a quarter of the samples";
  EXPECT_NEAR(walked.mean, met.mean, 4 * met.standard_error);
}

// In a large image a small lamp is met now and then, and each time there is a firefly.
TEST(Manifolds, AreTriedWhereMeetingsAreBrightHoweverManyPixelsThereAre) {
  for (const int film : {32, 1024}) {
    TestScene base;
    add_floor(base.conductor(0.7f, 0.5f), &base);
    const Renderer small = renderer_with_seeds(with_lamp(mirrors(base, film), 0.06)),
                   large = renderer_with_seeds(with_lamp(mirrors(base, film), 0.3));
    EXPECT_TRUE(walks(small)) << film;
    EXPECT_FALSE(walks(large)) << film;
    EXPECT_GT(large.plan().missing.all, 0.02) << "more than what walks are worth if it is never met";
  }
}

TEST(Manifolds, DoNotDependOnThreads) {
  const TestScene s = shaded_light(48);
  const Renderer one = renderer_with_seeds(s, 1), three = renderer_with_seeds(s, 3);
  ASSERT_TRUE(walks(one));
  const ManifoldSeeds &a = one.context().scene.manifolds, &b = three.context().scene.manifolds;
  ASSERT_EQ(a.groups.size(), b.groups.size());
  for (size_t i = 0; i < a.groups.size(); ++i) EXPECT_EQ(a.groups[i].count, b.groups[i].count);
  EXPECT_EQ(render_partial(one).camera, render_partial(three, 3).camera);
}

// Walks that find all are as good as light paths, which splat and are joined with more noise.
TEST(Manifolds, TakeThePlaceOfLightPaths) {
  const TestScene s = shaded_light(32);
  const Renderer renderer = renderer_with_seeds(s);
  EXPECT_GT(renderer.context().scene.manifolds.found, 0.99);
  ASSERT_TRUE(renderer.context().scene.manifolds.suffice());
  const PilotReport report = run_pilot(renderer, 1, [] { return true; });
  EXPECT_EQ(report.chosen.strategies & kLightPaths, 0u);
  const auto light_paths =
      std::count_if(report.estimates.begin(), report.estimates.end(),
                    [](const PlanEstimate& e) { return (e.plan.strategies & kLightPaths) != 0; });
  EXPECT_GT(light_paths, 0);
  EXPECT_LT(light_paths, static_cast<int64_t>(report.estimates.size()));
  EXPECT_EQ(run_pilot(renderer, 3, [] { return true; }).chosen, report.chosen);
  RenderSettings chosen = settings_for(s.scene, Integrator::kAuto, 256, 8);
  chosen.plan = report.chosen;
  EXPECT_EQ(Renderer(s.scene, chosen, 1).plan().lost_light, "");
  const Estimate walked = render_batches(s.scene, chosen, 8).mean(),
                 joined =
                     render_batches(s.scene, settings_for(s.scene, Integrator::kBdpt, 1024, 8), 8).mean();
  EXPECT_NEAR(walked.mean, joined.mean, 0.005 * joined.mean + 4 * joined.standard_error);
}

// The floor below the light has its image at height 2.
TEST(Manifolds, KnowTheIrradianceThatTheyBring) {
  const Renderer renderer = renderer_with_seeds(shaded_light(32));
  const ManifoldSeeds& seeds = renderer.context().scene.manifolds;
  ASSERT_FALSE(seeds.empty());
  const ManifoldSeeds::Table* table = seeds.at(placed(renderer, {0.05, 0, 0.05}));
  ASSERT_NE(table, nullptr);
  EXPECT_NEAR(table->irradiance, 5.0 / 3 / 4, 0.1) << "the mean of the channels' intensities";
}

// Where few vertices walk, each stands for many.
TEST(Manifolds, WalkSeldomWhereTheyBringLittle) {
  const TestScene s = shaded_light(32);
  const Renderer often = renderer_with_seeds(s), seldom = renderer_with_seeds(s);
  // As if the rest of the image were so much brighter.
  const_cast<ManifoldSeeds&>(seldom.context().scene.manifolds).worth_a_walk *= 4;
  const ManifoldSeeds& seeds = seldom.context().scene.manifolds;
  for (const ManifoldSeeds::Table& table : seeds.tables) {
    EXPECT_LT(seeds.chance(table, 1), 1);
    EXPECT_LE(seeds.chance(table, 0.1f), seeds.chance(table, 1));
    EXPECT_GT(seeds.chance(table, 0), 0);
  }
  const RenderSettings settings = settings_for(s.scene, Integrator::kPt, 64, 8);
  const Estimate expected = mean_over_seeds(often, settings), mean = mean_over_seeds(seldom, settings);
  // Of 16 seeds each, so their ratio has a standard deviation of a quarter.
  EXPECT_GT(mean.standard_error, 1.2 * expected.standard_error);
  EXPECT_NEAR(mean.mean, expected.mean, 4 * (expected.standard_error + mean.standard_error));
  EXPECT_LT(mean.standard_error, 0.01 * mean.mean);
}

// One way to the image of a point: one walk.
TEST(Manifolds, HaveNoSeedsThatFindTheSame) {
  const TestScene s = shaded_light(32);
  const Renderer renderer = renderer_with_seeds(s);
  const ManifoldSeeds& seeds = renderer.context().scene.manifolds;
  ASSERT_FALSE(seeds.empty());
  for (const ManifoldGroup& group : seeds.groups) {
    EXPECT_LE(group.count, 1);
    EXPECT_EQ(group.probability, 1);
  }
  EXPECT_FALSE(seeds.meetable);
}

}  // namespace
}  // namespace lightmill::test
