// What is learnt of lights: there is a guide where much is hidden and none where nothing is, it prefers what
// gets in, and it does not depend on threads.
#include "worker/render/guiding/training/next_event_guide_training.h"

#include <gtest/gtest.h>

#include "tests/support/render.h"
#include "tests/support/test_scene.h"
#include "worker/render/light/light_sampling.h"
#include "worker/render/renderer.h"

namespace lightmill::test {
namespace {

/// A room of 4 x 4 x 4, from within, with a window of 1 x 1 in its wall at z = 2, under an even sky and a sun
/// that is behind the opposite wall.
TestScene room_with_a_window() {
  TestScene s;
  const int grey = s.diffuse(0.5f);
  s.quad({-2, -2, -2}, {0, 0, 4}, {4, 0, 0}, grey);
  s.quad({-2, 2, -2}, {4, 0, 0}, {0, 0, 4}, grey);
  s.quad({-2, -2, -2}, {0, 4, 0}, {0, 0, 4}, grey);
  s.quad({2, -2, -2}, {0, 0, 4}, {0, 4, 0}, grey);
  s.quad({-2, -2, -2}, {4, 0, 0}, {0, 4, 0}, grey);
  s.quad({-2, -2, 2}, {0, 2, 0}, {4, 0, 0}, grey);
  s.quad({-2, 1, 2}, {0, 1, 0}, {4, 0, 0}, grey);
  s.quad({-2, 0, 2}, {0, 1, 0}, {1.5, 0, 0}, grey);
  s.quad({0.5, 0, 2}, {0, 1, 0}, {1.5, 0, 0}, grey);
  s.environment({1, 1, 1});
  s.scene.lights.push_back({DistantLight{{3, 3, 3}, normalized({0, -0.2, 1}), 0}, {}});
  s.camera({0.7, 0.1, -1.3}, {-1, -1, 1}, 60).film(64, 64);
  return s;
}

const LightTable& guided_lights_of(const Renderer& renderer) { return renderer.context().scene.lights; }

Renderer renderer_with_guide(const TestScene& s, int threads = 1) {
  return Renderer(s.scene, settings_for(s.scene, Integrator::kPt, 4, 5), threads);
}

TEST(LightLearning, PrefersWhatGetsIn) {
  const Renderer renderer = renderer_with_guide(room_with_a_window());
  const LightTable& lights = guided_lights_of(renderer);
  ASSERT_FALSE(lights.guide.empty());
  EXPECT_GT(lights.guide.gain, 3);
  // The even sky has got bins, and a fifth of the samples of lights get out where a hundredth did.
  ASSERT_EQ(lights.environments.size(), 1u);
  const RenderScene& scene = renderer.context().scene;
  const Vec3d at = scene.normalised_point({-1, -1.9, 0});
  const Vec3<float> p{static_cast<float>(at.x), static_cast<float>(at.y), static_cast<float>(at.z)};
  const Vec3d lo = scene.normalised_point({-0.5, 0, 2}), hi = scene.normalised_point({0.5, 1, 2});
  int out = 0;
  constexpr int kSamples = 4000;
  for (int i = 0; i < kSamples; ++i) {
    const auto u = [&](uint32_t k) {
      return static_cast<float>(hash32(static_cast<uint32_t>(i) * 4 + k) >> 8) * 0x1p-24f;
    };
    const auto d = sample_direct<float>(lights, p, u(0), u(1), u(2), u(3));
    if (lights.type[static_cast<size_t>(d.light)] != kInfiniteLight || !(d.wi.z > 0)) continue;
    const double t = (lo.z - double{p.z}) / double{d.wi.z};
    const double x = double{p.x} + t * double{d.wi.x}, y = double{p.y} + t * double{d.wi.y};
    out += x > lo.x && x < hi.x && y > lo.y && y < hi.y;
  }
  EXPECT_GT(out, kSamples / 5);
}

TEST(LightLearning, DoesNotDependOnThreads) {
  const TestScene s = room_with_a_window();
  const Renderer one = renderer_with_guide(s, 1), three = renderer_with_guide(s, 3);
  const LightTable &a = guided_lights_of(one), &b = guided_lights_of(three);
  EXPECT_EQ(a.guide.table_of, b.guide.table_of);
  EXPECT_EQ(a.guide.probability, b.guide.probability);
  EXPECT_EQ(a.guide.grid.origin, b.guide.grid.origin);
  EXPECT_EQ(a.environments[0].bins.share, b.environments[0].bins.share);
}

TEST(LightLearning, LeavesAloneWhatItCanNotHelp) {
  // No light at infinity; one that shines on everything that is seen; none to choose from.
  TestScene lamp = cornell_room();
  EXPECT_TRUE(guided_lights_of(renderer_with_guide(lamp)).guide.empty());
  TestScene sun;
  sun.quad({-1, -1, -1}, {0, 0, 2}, {2, 0, 0}, sun.diffuse(0.5f));
  sun.scene.lights.push_back({DistantLight{{3, 3, 3}, {0, -1, 0}, 0}, {}});
  sun.camera({0, 1, -3}, {0, -1, 0}, 40).film(16, 16);
  EXPECT_TRUE(guided_lights_of(renderer_with_guide(sun)).guide.empty());
  // Nothing in sight.
  TestScene away = room_with_a_window();
  away.camera({0, 0, 9}, {0, 0, 99}, 40);
  EXPECT_TRUE(guided_lights_of(renderer_with_guide(away)).guide.empty());
  EXPECT_TRUE(guided_lights_of(renderer_with_guide(away)).environments.empty()) << "the sky is even again";
}

}  // namespace
}  // namespace lightmill::test
