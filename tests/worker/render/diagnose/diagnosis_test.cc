// The diagnosis accounts for the whole image: weighted strategy images add up to it, and every unweighted one
// estimates the paths of its length.
#include "worker/render/diagnose/diagnosis.h"

#include <gtest/gtest.h>

#include "common/base/error.h"
#include "common/film/film.h"
#include "tests/support/render.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

bool always() { return true; }

TestScene room() {
  TestScene s = cornell_room();
  s.sphere({0.3, -0.6, 0.3}, 0.3, s.dielectric(1.5f, 0));
  s.camera({0, 0, -0.95}, {0, 0, 1}, 80).film(48, 40);
  return s;
}

double mean(const Image& image) {
  double sum = 0;
  for (const float x : image.data) sum += static_cast<double>(x);
  return sum / static_cast<double>(image.data.size());
}

TEST(Diagnosis, WeightedImagesAddUpToTheImageWhateverTheThreads) {
  const TestScene s = room();
  const RenderSettings settings = settings_for(s.scene, Integrator::kBdpt, 8, 5);
  const Diagnosis d = diagnose(s.scene, settings, 2, always);
  Image sum(48, 40);
  uint64_t visible = 0, rays = 0;
  for (int i = 0; i <= kRecordedVertices; ++i) {
    for (int t = 0; t <= kRecordedVertices; ++t) {
      const StrategyCounts& c = d.counts[static_cast<size_t>(i)][static_cast<size_t>(t)];
      EXPECT_EQ(c.evaluated, c.zero + c.rouletted + c.occluded + c.visible) << i << " " << t;
      if (i > 0) visible += c.visible, rays += c.visible + c.occluded;
      if (const auto image = d.film.weighted(i, t, 8)) {
        for (size_t k = 0; k < sum.data.size(); ++k) sum.data[k] += image->data[k];
      }
    }
  }
  EXPECT_GT(visible, 0u);
  EXPECT_EQ(rays, d.counters.shadow_rays);
  for (size_t k = 0; k < sum.data.size(); ++k) {
    EXPECT_NEAR(sum.data[k], d.image.data[k], 1e-4f * (1 + d.image.data[k])) << k;
  }
  const Diagnosis one = diagnose(s.scene, settings, 1, always);
  EXPECT_EQ(one.image.data, d.image.data);
  ASSERT_EQ(one.brightest.size(), d.brightest.size());
  for (size_t k = 0; k < d.brightest.size(); ++k) {
    EXPECT_EQ(one.brightest[k].sample, d.brightest[k].sample);
    EXPECT_EQ(one.brightest[k].contribution.pixel, d.brightest[k].contribution.pixel);
  }
}

TEST(Diagnosis, BrightestPathsHaveTheirVerticesInTheRoom) {
  const TestScene s = room();
  const Diagnosis d = diagnose(s.scene, settings_for(s.scene, Integrator::kBdpt, 4, 5), 1, always);
  ASSERT_FALSE(d.brightest.empty());
  for (const BrightPath& p : d.brightest) {
    EXPECT_EQ(p.camera.size(), static_cast<size_t>(p.contribution.t) - 1);
    EXPECT_EQ(p.light.size(), static_cast<size_t>(std::max(p.contribution.s - 1, 0)));
    for (const auto* list : {&p.camera, &p.light}) {
      for (const BrightPath::Vertex& v : *list) {
        EXPECT_LE(std::max({std::abs(v.position.x), std::abs(v.position.y), std::abs(v.position.z)}), 1.0001);
        EXPECT_LT(v.material, static_cast<int>(s.scene.materials.size()));
      }
    }
  }
}

// In a room without delta lobes and without sight of the lamp, next event and light tracing each see all
// light that is scattered once; their unweighted images have the same mean.
TEST(Diagnosis, UnweightedStrategiesOfOneLengthAgree) {
  TestScene s = cornell_room();
  s.camera({0, 0.6, -0.95}, {0, -1, 0.3}, 70).film(32, 32);
  const Diagnosis d = diagnose(s.scene, settings_for(s.scene, Integrator::kBdpt, 256, 2), 1, always);
  const auto next_event = d.film.unweighted(1, 2, 256), lens = d.film.unweighted(2, 1, 256);
  ASSERT_TRUE(next_event && lens);
  EXPECT_NEAR(mean(*next_event) / mean(*lens), 1, 0.02);
  EXPECT_GT(mean(*next_event), 1.2 * mean(*d.film.weighted(1, 2, 256)));
}

// A visible lamp reaches as far as the filter by hits and by light tracing.
TEST(Diagnosis, EmittersAreSeenThroughTheFilter) {
  TestScene s;
  s.quad({-0.3, -0.3, 2}, {0, 0.5, 0}, {0.7, 0, 0}, s.diffuse(0.0f), {.radiance = {1, 2, 3}});
  s.camera({0, 0, 0}, {0, 0, 1}, 60).film(16, 16);
  s.scene.film.crop = {{4.0 / 16, 1, 5.0 / 16, 1}};  // across the lamp
  s.scene.filter = {.kind = FilterKind::kGaussian, .xradius = 2, .yradius = 2};
  const Diagnosis d = diagnose(s.scene, settings_for(s.scene, Integrator::kBdpt, 4096, 1), 2, always);
  const auto hits = d.film.unweighted(0, 2, 4096), lens = d.film.unweighted(1, 1, 4096);
  ASSERT_TRUE(hits && lens);
  for (size_t k = 0; k < hits->data.size(); ++k) EXPECT_NEAR(lens->data[k], hits->data[k], 0.06f) << k;
}

// The noise of sets that did not run is predicted from one that did, against renders of those sets: 256 seeds
// of one sample per pixel each, so that nothing is stratified within a pixel. Light tracing is stratified
// over the light paths of a cell, which the prediction does not know: it may be too high there.
TEST(Diagnosis, PredictsTheNoiseOfOtherSets) {
  TestScene s = cornell_room();
  s.sphere({0.3, -0.7, 0.2}, 0.25, s.conductor(0.9f, 0.2f));
  s.camera({0, 0.6, -0.95}, {0, -1, 0.3}, 70).film(32, 32);
  const Diagnosis d = diagnose(s.scene, settings_for(s.scene, Integrator::kBdpt, 1024, 5), 1, always);
  const Renderer scene(s.scene, settings_for(s.scene, Integrator::kBdpt, 1, 5), 1);
  for (size_t i = 1; i < StrategyFilm::kSets; ++i) {
    const Strategies set = StrategyFilm::set(i);
    if (!(set & kNextEvent)) continue;  // the few hits on the lamp would need far more samples
    RenderSettings settings = settings_for(s.scene, Integrator::kBdpt, 1, 5);
    settings.plan = SamplingPlan{.strategies = set};
    constexpr int kSeeds = 256;
    std::vector<double> sum(d.image.data.size()), squares(d.image.data.size());
    for (settings.seed = 100; settings.seed < 100 + kSeeds; ++settings.seed) {
      Film film(settings.grid);
      film.fold(render_partial(Renderer(scene, settings)));
      const Image image = film.resolve();
      for (size_t k = 0; k < sum.size(); ++k) {
        sum[k] += static_cast<double>(image.data[k]);
        squares[k] += static_cast<double>(image.data[k]) * static_cast<double>(image.data[k]);
      }
    }
    double measured = 0;
    for (size_t k = 0; k < sum.size(); ++k) {
      const double mean = sum[k] / kSeeds, r = static_cast<double>(d.image.data[k]);
      measured += (squares[k] / kSeeds - mean * mean) * kSeeds / (kSeeds - 1) / (r * r + 1e-2);
    }
    measured /= static_cast<double>(sum.size());
    const double ratio = d.film.predicted_variance(i, 1024, d.image) / measured;
    EXPECT_GT(ratio, 0.85) << strategy_names(set);
    EXPECT_LT(ratio, set & kLightTracing ? 1.5 : 1.15) << strategy_names(set);
  }
}

TEST(Diagnosis, RefusesWhatWouldNotFit) {
  const TestScene s = room();
  RenderSettings settings = settings_for(s.scene, Integrator::kBdpt, 1, 100);
  settings.grid.width = settings.grid.height = 4000;
  settings.grid.crop = {0, 0, 4000, 4000};
  EXPECT_THROW(diagnose(s.scene, settings, 1, always), Error);
}

TEST(Diagnosis, StopsWhenAsked) {
  const TestScene s = room();
  EXPECT_THROW(diagnose(s.scene, settings_for(s.scene, Integrator::kBdpt, 4, 5), 1, [] { return false; }),
               Error);
}

}  // namespace
}  // namespace lightmill::test
