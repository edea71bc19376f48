// Infinite lights behind portals: a window under an even sky is a lamp of its size and radiance; every set of
// strategies gives the same image, with a sun in the sky and a wall outside.
//
// Confidence as in strategies_test.cc.
#include <gtest/gtest.h>

#include "common/image/image.h"
#include "tests/statistical/agreement/strategy_set.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace {

constexpr Rgb kSky{1, 1.5f, 2};

/// A ball on a floor before a wall that ends below the window, which is not in sight: lt does not see it.
TestScene courtyard() {
  TestScene s;
  s.quad({-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, s.diffuse({0.6f, 0.5f, 0.3f}));
  s.quad({-2, 0, 2}, {0, 1.9, 0}, {4, 0, 0}, s.diffuse(0.7f));
  s.sphere({0.4, 0.5, 0}, 0.5, s.diffuse(0.8f));
  s.camera({0, 1, -3}, {0, 0.4, 0}, 50).film(16, 16);
  return s;
}

void add_window(TestScene* s, InfiniteLight sky) {
  sky.portal = {{{-0.6, 2, -0.4}, {0.6, 2, -0.4}, {0.6, 2, 0.4}, {-0.6, 2, 0.4}}};
  s->scene.lights.push_back({std::move(sky), {}});
}

TEST(PortalTest, AWindowUnderAnEvenSkyIsALamp) {
  TestScene lamp = courtyard();
  lamp.quad({-0.6, 2, -0.4}, {1.2, 0, 0}, {0, 0, 0.8}, lamp.diffuse(0),
            {.radiance = kSky, .two_sided = true});
  TestScene open = courtyard();
  add_window(&open, {kSky});
  for (const Integrator integrator : {Integrator::kPt, Integrator::kLt, Integrator::kBdpt}) {
    SCOPED_TRACE(static_cast<int>(integrator));
    const auto render = [&](const TestScene& s, uint64_t seed) {
      return render_batches(s.scene, settings_for(s.scene, integrator, 4096, 4, seed), 16);
    };
    const Batches by_lamp = render(lamp, 1), by_sky = render(open, 2);
    EXPECT_EQ(by_sky.counters.nonfinite, 0u);
    AgreementTest test;
    test.max_excluded = 0.2;
    EXPECT_TRUE(images_agree(by_lamp, by_sky, test));
    EXPECT_FALSE(images_agree(by_lamp, scaled(by_sky, 1.05f), test)) << "the test notices nothing";
  }
}

class PortalSets : public ::testing::TestWithParam<unsigned> {};

// The wall outside stands across the window: it shades, and is seen, but no light goes from it to the sky
// through the window, so that it is black.
TEST_P(PortalSets, AgreeWithAWallOutside) {
  const TemporaryFolder folder;
  Image image(8, 8);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = 0.2f + static_cast<float>(i % 7) / 7;
  for (int c = 0; c < 3; ++c) image.pixel(4, 5)[c] = 8;
  write_image(image, folder.file("sky.exr"));
  TestScene s = courtyard();
  s.quad({0.1, 2, -0.5}, {0, 0.7, 0}, {0.1, 0, 1}, s.diffuse(0.9f));
  s.quad({0.1, 2, -0.5}, {0.1, 0, 1}, {0, 0.7, 0}, s.diffuse(0.9f));
  InfiniteLight sky{{1, 1, 1}, folder.file("sky.exr")};
  sky.light_to_world.m = {{{1, 0, 0, 0}, {0, 0, 1, 0}, {0, -1, 0, 0}, {0, 0, 0, 1}}};
  add_window(&s, sky);
  expect_agrees_with_all(
      s, GetParam(),
      {.max_depth = 3, .weak_spp = 16384, .all_spp = 8192, .once_spp = 8192, .connections_notice = 2});
}

INSTANTIATE_TEST_SUITE_P(All, PortalSets, ::testing::Range(1u, kAllStrategies + 1), set_name);

}  // namespace
}  // namespace lightmill::test
