// A room that is lit through its window, where a next-event guide is in use: every set of strategies gives
// the same image, and the mean is that without a guide.
//
// Confidence as in strategies_test.cc.
#include <gtest/gtest.h>

#include <cmath>

#include "common/image/image.h"
#include "tests/statistical/agreement/strategy_set.h"
#include "tests/support/render.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"
#include "worker/render/pipeline/context.h"
#include "worker/render/renderer.h"

namespace lightmill::test {
namespace {

/// Half a room: floor, a wall with a window towards the light, a roof; a ball inside. A sky with a bright
/// spot, a sun of that half angle, and a lamp, none of which is in sight: lt does not see lights.
TestScene half_a_room(const std::string& image, double half_angle) {
  TestScene s;
  const int grey = s.diffuse(0.6f);
  s.quad({-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, s.diffuse({0.6f, 0.5f, 0.3f}));
  s.quad({-2, 2, -2}, {4, 0, 0}, {0, 0, 4}, grey);
  s.quad({-2, 0, -2}, {0, 2, 0}, {0, 0, 4}, grey);
  s.quad({-2, 0, 2}, {0, 2, 0}, {4, 0, 0}, grey);
  s.quad({2, 0, -2}, {0, 0, 4}, {0, 0.6, 0}, grey);
  s.quad({2, 1.5, -2}, {0, 0, 4}, {0, 0.5, 0}, grey);
  s.sphere({0.4, 0.5, 0.3}, 0.5, s.diffuse(0.8f));
  s.quad({-1, 1.9, 0}, {0.5, 0, 0}, {0, 0, 0.5}, grey, {.radiance = {2, 2, 2}});
  InfiniteLight sky{{1, 1, 1}, image};
  sky.light_to_world.m = {{{1, 0, 0, 0}, {0, 0, 1, 0}, {0, -1, 0, 0}, {0, 0, 0, 1}}};
  s.scene.lights.push_back({sky, {}});
  s.scene.lights.push_back({DistantLight{{3, 2.5f, 2}, normalized({-0.9, -0.5, 0.1}), half_angle}, {}});
  s.camera({1.8, 1, -1.5}, {-1, 0.2, 0.5}, 50).film(16, 16);
  return s;
}

void write_sky(const std::string& path) {
  Image image(32, 32);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = 0.2f + static_cast<float>(i % 7) / 7;
  for (int c = 0; c < 3; ++c) image.pixel(20, 13)[c] = 30;
  write_image(image, path);
}

class NextEventGuideSets : public ::testing::TestWithParam<unsigned> {};

TEST_P(NextEventGuideSets, Agree) {
  const TemporaryFolder folder;
  write_sky(folder.file("sky.exr"));
  const TestScene s = half_a_room(folder.file("sky.exr"), 10);
  const Renderer renderer(s.scene, settings_for(s.scene, Integrator::kPt, 4, 3), 1);
  ASSERT_FALSE(renderer.context().scene.lights.guide.empty());
  expect_agrees_with_all(
      s, GetParam(),
      {.max_depth = 3, .weak_spp = 16384, .all_spp = 2048, .once_spp = 2048, .connections_notice = 2});
}

// All but connections alone, which neither draw lights nor are weighed against who does, and whose corners
// are the noisiest that there is.
std::vector<unsigned> sets_of_a_guide() {
  std::vector<unsigned> sets;
  for (unsigned set = 1; set <= kAllStrategies; ++set) {
    if (set != kVertexConnections) sets.push_back(set);
  }
  return sets;
}

INSTANTIATE_TEST_SUITE_P(All, NextEventGuideSets, ::testing::ValuesIn(sets_of_a_guide()), set_name);

/// With smoke in it, which is lit through the window and hides what is behind.
TestScene half_a_smoky_room(const std::string& image) {
  TestScene s = half_a_room(image, 10);
  const Vec3d lo{-1.6, 0.2, -0.8}, hi{-0.3, 1.8, 0.8};
  const auto density = [](double x, double y, double z) {
    return 1 + std::sin(4 * x + 3 * y) * std::cos(5 * z);
  };
  const int smoke = add_grid_medium(&s, {0.2f, 0.3f, 0.4f}, {2, 2.5f, 3},
                                    grid_of(field_of({8, 9, 7, lo, hi}, density)), 0.4f);
  bounding_box(&s, lo, hi, smoke);
  return s;
}

class GuideInMediaSets : public ::testing::TestWithParam<unsigned> {};

// Hits alone draw no lights: so the guide has no say in them.
TEST_P(GuideInMediaSets, Agree) {
  const TemporaryFolder folder;
  write_sky(folder.file("sky.exr"));
  const TestScene s = half_a_smoky_room(folder.file("sky.exr"));
  const Renderer renderer(s.scene, settings_for(s.scene, Integrator::kPt, 4, 3), 1);
  ASSERT_FALSE(renderer.context().scene.lights.guide.empty());
  expect_agrees_with_all(
      s, GetParam(),
      {.max_depth = 3, .weak_spp = 16384, .all_spp = 2048, .once_spp = 2048, .connections_notice = 2});
}

INSTANTIATE_TEST_SUITE_P(All, GuideInMediaSets,
                         ::testing::Values(kEmissionHits, kNextEvent, kLightTracing,
                                           kEmissionHits | kNextEvent, kEmissionHits | kLightTracing,
                                           kNextEvent | kLightTracing),
                         set_name);

// A sun without size has emission cells; what hits alone can not make is left out.
class EmissionCellSets : public ::testing::TestWithParam<unsigned> {};

TEST_P(EmissionCellSets, Agree) {
  const TemporaryFolder folder;
  write_sky(folder.file("sky.exr"));
  const TestScene s = half_a_room(folder.file("sky.exr"), 0);
  const Renderer renderer(s.scene, settings_for(s.scene, Integrator::kPt, 4, 3), 1);
  ASSERT_EQ(renderer.context().scene.lights.emission_cells.size(), 1u);
  expect_agrees_with_all(s, GetParam(), {.max_depth = 3, .all_spp = 2048});
}

INSTANTIATE_TEST_SUITE_P(All, EmissionCellSets,
                         ::testing::Values(kNextEvent, kLightTracing, kNextEvent | kVertexConnections,
                                           kEmissionHits | kLightTracing,
                                           kNextEvent | kLightTracing | kVertexConnections));

}  // namespace
}  // namespace lightmill::test
