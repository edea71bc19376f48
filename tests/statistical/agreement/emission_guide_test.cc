// Lights whose light paths go where they bring something: the image is what it is without, and by every set
// of strategies.
//
// Confidence as in strategies_test.cc.
#include <gtest/gtest.h>

#include "tests/statistical/agreement/strategy_set.h"
#include "tests/support/render.h"
#include "worker/render/pipeline/context.h"
#include "worker/render/renderer.h"

namespace lightmill::test {
namespace {

/// A floor behind a lamp, which shines the other way: all light comes back from a screen that little of it
/// meets.
TestScene lamp_and_screen() {
  TestScene s;
  s.quad({-6, 0, -1.4}, {0, 0, 2.8}, {2.8, 0, 0}, s.diffuse({0.6f, 0.5f, 0.3f}));
  s.quad({-0.5, 1, -0.5}, {0, 0, 1}, {0, 1, 0}, s.diffuse(0.8f));
  s.quad({-3, 1.8, -0.3}, {0, 0, 0.6}, {0, -0.6, 0}, s.diffuse(0), {.radiance = {40, 36, 30}});
  s.camera({-4.6, 3, 0.2}, {-4.6, 0, 0}, 45).film(32, 32);
  return s;
}

/// A floor in the shade of a point, and a dull metal ball beyond that throws some light back.
TestScene point_and_ball() {
  TestScene s;
  s.quad({-6, 0, -1.4}, {0, 0, 2.8}, {2.8, 0, 0}, s.diffuse({0.6f, 0.5f, 0.3f}));
  s.quad({-3, 1.3, -0.6}, {0, 0, 1.2}, {0, 0.95, 0}, s.diffuse(0));
  s.sphere({-2.6, 2.2, 2.5}, 0.4, s.conductor(0.9f, 0.15f));
  s.camera({-4.6, 3, 0.2}, {-4.6, 0, 0}, 45).film(32, 32);
  return s.point_light({-2.9, 2.2, 0}, {10, 9, 8});
}

TEST(EmissionGuide, LeaveTheImageAsItIs) {
  for (const TestScene& s : {lamp_and_screen(), point_and_ball()}) {
    const RenderSettings settings = settings_for(s.scene, Integrator::kBdpt, 512, 3);
    RenderSettings plain_settings = settings;
    plain_settings.plan = plan_of(settings);
    plain_settings.plan->guided_emission = false;
    const Renderer guided_emission(s.scene, settings, 1), plain(guided_emission, plain_settings);
    ASSERT_TRUE(guided_emission.context().lights.has_emission_guide());
    ASSERT_FALSE(plain.context().lights.has_emission_guide());
    EXPECT_TRUE(means_agree(mean_over_seeds(guided_emission, settings),
                            mean_over_seeds(plain, plain_settings), {.resolution = 0.05}));
  }
}

class EmissionGuideSets : public ::testing::TestWithParam<unsigned> {};

TEST_P(EmissionGuideSets, Agree) {
  // Camera paths alone don't use the emission guide and find the lamp with luck.
  const int64_t spp = GetParam() & kLightPaths ? 6144 : 16384;
  expect_agrees_with_all(lamp_and_screen(), GetParam(),
                         {.max_depth = 3, .spp = spp, .weak_spp = 8192, .all_spp = 1024, .once_spp = 1024});
}

std::vector<unsigned> sets_to_compare() {
  std::vector<unsigned> sets{kEmissionHits | kNextEvent};
  for (unsigned set = 1; set <= kAllStrategies; ++set) {
    if (set & kLightPaths) sets.push_back(set);
  }
  return sets;
}

INSTANTIATE_TEST_SUITE_P(All, EmissionGuideSets, ::testing::ValuesIn(sets_to_compare()), set_name);

}  // namespace
}  // namespace lightmill::test
