// Scenes with a photon guide: closed answers, and every set of strategies against all.
//
// Confidence as in strategies_test.cc.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/statistical/agreement/strategy_set.h"
#include "tests/support/render.h"
#include "worker/render/pipeline/context.h"
#include "worker/render/renderer.h"

namespace lightmill::test {
namespace {

bool has_guide(const TestScene& s, const RenderSettings& settings) {
  return !Renderer(s.scene, settings, 1).context().scene.caustics.empty();
}

// Oracles 8 and 13 together: a sphere that a floor sees in a mirror alone. E = pi L r (R/d)^2 cos, of its
// image; the second mirror, which the camera looks into, makes the last segment one that nothing can be
// joined to.
TEST(GuidedPaths, LampInAMirrorSeenInAMirror) {
  constexpr double kRadius = 0.04, kReflected = 0.9, kAlbedo = 0.6;
  constexpr float kL = 100;
  const Vec3d lamp{0, 1.5, 0.5};
  TestScene s;
  const int black = s.diffuse(0), mirror = s.conductor(static_cast<float>(kReflected), 0);
  s.quad({-0.5, 0, 0}, {0, 0, 1}, {1, 0, 0}, s.diffuse(static_cast<float>(kAlbedo)));
  s.quad({-2, 0, 1.5}, {0, 3, 0}, {4, 0, 0}, mirror);
  s.quad({-1, 0.8, 0}, {0, 0, 1}, {2, 0, 0}, black);  // between lamp and floor
  s.sphere(lamp, kRadius, black, {.radiance = {kL, kL, kL}});
  s.quad({-0.3, 0.2, -0.2}, {0.6, 0, 0}, {0, 0.3, 0}, mirror);
  // The camera looks at the image of the floor's middle in the small mirror at z = -0.2.
  s.camera({0, 0.4, 0.1}, {0, 0, -0.9}, 1.0).film(64, 64);
  for (const Integrator integrator : {Integrator::kPt, Integrator::kBdpt}) {
    const RenderSettings settings = settings_for(s.scene, integrator, 1024, 3);
    ASSERT_TRUE(has_guide(s, settings)) << name_of(integrator);
    // Mean over the floor's part in sight: so small that the middle stands for it.
    const Vec3d image{0, 1.5, 2.5}, floor{0, 0, 0.5};
    const double d = length(image - floor), cosine = (image.y - floor.y) / d;
    const double expected =
        kReflected * kReflected * kAlbedo * double{kL} * std::pow(kRadius / d, 2) * cosine;
    EXPECT_TRUE(mean_is(render_batches(s.scene, settings, 16).mean(), expected, {.resolution = 0.05}))
        << name_of(integrator);
  }
}

/// A guide to the room's lamp and to a wall, which nobody needs, from everywhere on the room's sides.
PhotonGuide needless_guide(const RenderScene& scene) {
  Random random(1);
  std::vector<Photon> photons(1 << 16);
  for (size_t i = 0; i < photons.size(); ++i) {
    const auto at = [&] { return 2.0 * double{random.uniform()} - 1; };
    std::array<double, 3> side{at(), at(), at()};
    side[i % 3] = i / 3 % 2 ? 1 : -1;
    const Vec3d from{side[0], side[1], side[2]};
    const Vec3d to = i / 6 % 3 ? Vec3d{0.3 * at(), 1, 0.3 * at()} : Vec3d{1, at(), at()};
    const Vec3d w = normalized(to - from), p = scene.normalised_point(from);
    photons[i].p = {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
    photons[i].power = 1;
    photons[i].w = {static_cast<float>(w.x), static_cast<float>(w.y), static_cast<float>(w.z)};
  }
  PhotonGuide guide = make_photon_guide(photons);
  guide.share = 0.5f;
  return guide;
}

// Whatever the guide is, the image is what it is without: every density that has the guide in it shows here,
// as the lamp is near and large, and half of the paths are led to it.
TEST(GuidedPaths, LeaveTheImageAsItIs) {
  const TestScene s = cornell_room();
  for (const Strategies set : {kEmissionHits, kEmissionHits | kNextEvent, kEmissionHits | kLightTracing,
                               kEmissionHits | kVertexConnections,
                               kEmissionHits | kNextEvent | kVertexConnections, kAllStrategies}) {
    const int64_t spp = set & (kNextEvent | kLightTracing) ? 128 : 512;
    RenderSettings settings = settings_for(s.scene, Integrator::kBdpt, spp, 3);
    settings.plan = SamplingPlan{.strategies = set};
    const Renderer plain(s.scene, settings, 1), guided(s.scene, settings, 1);
    // As if it had been learnt: renderers that share the scene find it there.
    const_cast<PhotonGuide&>(guided.context().scene.caustics) = needless_guide(guided.context().scene);
    EXPECT_TRUE(means_agree(mean_over_seeds(guided, settings), mean_over_seeds(plain, settings),
                            {.resolution = 0.0075}))
        << strategy_names(set);
  }
}

/// A ball of glass between a lamp and a wall, a diffuse floor, and a mirror that shows both; everything of a
/// colour of its own.
TestScene ball_and_mirror() {
  TestScene s;
  s.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, s.diffuse({0.7f, 0.5f, 0.3f}));
  s.quad({-1, 0, 1}, {0, 2, 0}, {2, 0, 0}, s.diffuse({0.3f, 0.6f, 0.5f}));
  s.quad({-1, 0, -1}, {0, 2, 0}, {0, 0, 2}, s.conductor(0.8f, 0));
  s.sphere({0.1, 0.7, 0.3}, 0.3, s.dielectric(1.5f, 0));
  s.quad({-0.3, 1.7, -0.3}, {0.6, 0, 0}, {0, 0, 0.6}, s.diffuse(0), {.radiance = {12, 10, 8}});
  s.camera({0.6, 1, -2.6}, {0, 0.6, 0.2}, 40).film(32, 32);
  return s;
}

// Light tracing alone knows nothing of the guide, and finds everything that is seen directly.
TEST(GuidedPaths, AgreeWithLightPaths) {
  TestScene s = ball_and_mirror();
  s.scene.shapes.erase(s.scene.shapes.begin() + 2);  // what the mirror shows light paths can't bring
  s.camera({0.9, 0.5, -0.9}, {0.2, 0, 0.4}, 30).film(32, 32);
  const RenderSettings pt = settings_for(s.scene, Integrator::kPt, 4096, 4);
  ASSERT_TRUE(has_guide(s, pt));
  const Batches by_camera = render_batches(s.scene, pt, 16);
  const Batches by_light = render_batches(s.scene, settings_for(s.scene, Integrator::kLt, 4096, 4), 16);
  EXPECT_EQ(by_camera.counters.nonfinite, 0u);
  EXPECT_TRUE(means_agree(by_camera.mean(), by_light.mean(), {.resolution = 0.02}));
}

class GuidedSets : public ::testing::TestWithParam<unsigned> {};

TEST_P(GuidedSets, Agree) {
  const TestScene s = ball_and_mirror();
  ASSERT_TRUE(has_guide(s, settings_for(s.scene, Integrator::kBdpt, 16, 4)));
  expect_agrees_with_all(s, GetParam(),
                         {.max_depth = 5, .spp = 2048, .weak_spp = 16384, .all_spp = 1024, .once_spp = 1024});
}

// What only hits can find is in each.
std::vector<unsigned> sets_with_hits() {
  std::vector<unsigned> sets;
  for (unsigned set = 1; set < kAllStrategies; ++set) {
    if (set & kEmissionHits) sets.push_back(set);
  }
  return sets;
}

INSTANTIATE_TEST_SUITE_P(All, GuidedSets, ::testing::ValuesIn(sets_with_hits()), set_name);

}  // namespace
}  // namespace lightmill::test
