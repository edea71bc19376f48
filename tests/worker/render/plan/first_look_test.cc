#include "worker/render/plan/first_look.h"

#include <gtest/gtest.h>

#include "common/base/error.h"
#include "tests/support/render.h"
#include "tests/support/test_scene.h"
#include "worker/render/renderer.h"

namespace lightmill::test {
namespace {

bool never_stop() { return true; }

/// A floor under an even sky: its radiance is known wherever it is seen. `light` scales the sky.
TestScene floor_under_a_sky(float light, int width, int height) {
  TestScene s;
  s.quad({-90, 0, -90}, {0, 0, 180}, {180, 0, 0}, s.diffuse({0.5f, 0.25f, 0.125f}));
  s.environment({light, light, light});
  s.camera({0, 3, 0}, {0.1, 0, 0}, 30).film(width, height);
  return s;
}

Image look_at(const TestScene& s, int threads) {
  return first_look(Renderer(s.scene, settings_for(s.scene, Integrator::kAuto, 16, 5), 1), threads,
                    never_stop);
}

TEST(FirstLook, IsASmallPictureOfTheScene) {
  for (const float light : {1.0f, 1e-20f, 3e6f}) {
    const Image image = look_at(floor_under_a_sky(light, 1000, 700), 2);
    ASSERT_EQ(image.width, 250);
    ASSERT_EQ(image.height, 175);
    const float albedo[3] = {0.5f, 0.25f, 0.125f};
    double means[3] = {};
    for (size_t i = 0; i < image.data.size(); ++i) {
      const float expected = albedo[i % 3] * light;
      ASSERT_GE(image.data[i], 0) << i;
      means[i % 3] += image.data[i] / expected / (250 * 175);
    }
    for (const double mean : means) EXPECT_NEAR(mean, 1, 5e-3);
  }
}

TEST(FirstLook, OfASmallFilmHasItsPixels) {
  const Image image = look_at(floor_under_a_sky(1, 30, 20), 1);
  EXPECT_EQ(image.width, 30);
  EXPECT_EQ(image.height, 20);
}

TEST(FirstLook, DoesNotDependOnThreads) {
  TestScene s = floor_under_a_sky(1, 300, 200);
  s.sphere({0, 1, 0}, 0.7, s.diffuse(0.7f));
  EXPECT_EQ(look_at(s, 1).data, look_at(s, 3).data);
}

TEST(FirstLook, EndsWhenItIsTold) {
  const TestScene s = floor_under_a_sky(1, 300, 200);
  const Renderer renderer(s.scene, settings_for(s.scene, Integrator::kAuto, 16, 5), 1);
  EXPECT_THROW(first_look(renderer, 1, [] { return false; }), Error);
}

}  // namespace
}  // namespace lightmill::test
