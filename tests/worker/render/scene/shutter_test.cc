// Shutters that open and close slowly: the times of an exposure against closed forms.
#include "worker/render/scene/shutter.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/test_scene.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill::test {
namespace {

constexpr int kSteps = RenderScene::kShutterSteps;

TEST(Shutter, OpenAllTheTimeNeedsNoTable) { EXPECT_TRUE(shutter_times({}, kSteps).empty()); }

TEST(Shutter, EvenlyOpenChangesNothing) {
  const std::vector<float> times = shutter_times({3, 3, 3, 3}, kSteps);
  for (int i = 0; i <= kSteps; ++i) EXPECT_NEAR(times[static_cast<size_t>(i)], i / double{kSteps}, 1e-6);
}

// A triangle: half of the light has come in the middle, and x^2 2 of it by x before.
TEST(Shutter, OpensAndCloses) {
  const std::vector<float> times = shutter_times({0, 1, 0}, kSteps);
  for (int i = 0; i <= kSteps; ++i) {
    const double share = i / double{kSteps};
    EXPECT_NEAR(times[static_cast<size_t>(i)],
                share < 0.5 ? std::sqrt(share / 2) : 1 - std::sqrt((1 - share) / 2), 1e-6);
  }
}

TEST(Shutter, ClosedPartsGetNoTime) {
  const std::vector<float> times = shutter_times({0, 0, 1, 0, 0}, kSteps);
  for (int i = 1; i < kSteps; ++i) {
    EXPECT_GT(times[static_cast<size_t>(i)], 0.25f);
    EXPECT_LT(times[static_cast<size_t>(i)], 0.75f);
  }
}

TEST(Shutter, TimesOfAScene) {
  TestScene s;
  s.quad({-1, -1, 2}, {0, 2, 0}, {2, 0, 0}, s.diffuse(0.5f));
  s.camera({0, 0, 0}, {0, 0, 1}, 40).film(8, 8);
  s.scene.shutter.openness = {0, 1, 0};
  const RenderScene scene = build_scene(s.scene);
  for (int i = 0; i < 1000; ++i) {
    const double u = (i + 0.5) / 1000;
    EXPECT_NEAR(scene.time_at(static_cast<float>(u)), u < 0.5 ? std::sqrt(u / 2) : 1 - std::sqrt((1 - u) / 2),
                0.012);  // one step at the ends
  }
}

}  // namespace
}  // namespace lightmill::test
