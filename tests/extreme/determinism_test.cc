// A partial is a function of scene, settings and tile: threads, their number and the order of packets leave
// its bits alone.
#include <gtest/gtest.h>

#include "common/film/film.h"
#include "tests/support/render.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

TestScene room(int width, int height) {
  TestScene s = cornell_room();
  s.sphere({-0.5, -0.6, 0.4}, 0.3, s.dielectric(1.5f, 0))
      .sphere({0.35, -0.2, 0.5}, 0.2, s.conductor(0.9f, 0.1f));
  s.film(width, height);
  s.scene.filter = {FilterKind::kGaussian, 1.5, 1.5, 0.5};  // splats cross cells
  return s;
}

class Determinism : public ::testing::TestWithParam<Integrator> {};

TEST_P(Determinism, ThreadsAndOrderLeaveTheBitsAlone) {
  const TestScene s = room(100, 70);  // cells cut by the film's edge
  const RenderSettings settings = settings_for(s.scene, GetParam(), 20, 6);
  const Partial first = render_partial(s.scene, settings);
  EXPECT_EQ(first.counters.nonfinite, 0u);
  const std::string digest = partial_digest(first);
  struct Run {
    int threads;
    PacketOrder order;
  };
  for (const Run run : {Run{1, PacketOrder::kReverse}, Run{2, PacketOrder::kForward},
                        Run{3, PacketOrder::kReverse}, Run{8, PacketOrder::kScattered}}) {
    const Partial again = render_partial(s.scene, settings, run.threads, run.order);
    ASSERT_EQ(partial_digest(again), digest) << run.threads;
    ASSERT_EQ(again.camera, first.camera);
    ASSERT_EQ(again.splats, first.splats);
    ASSERT_EQ(again.counters, first.counters);
  }
}

// Another seed and another number of samples do change it.
TEST_P(Determinism, SeedsMatter) {
  const TestScene s = room(40, 40);
  const std::string digest =
      partial_digest(render_partial(s.scene, settings_for(s.scene, GetParam(), 8, 6, 1)));
  EXPECT_NE(partial_digest(render_partial(s.scene, settings_for(s.scene, GetParam(), 8, 6, 2))), digest);
  EXPECT_NE(partial_digest(render_partial(s.scene, settings_for(s.scene, GetParam(), 9, 6, 1))), digest);
}

// 32 samples at once are the mean of their two halves.
TEST_P(Determinism, UnionsOfTilesAreTheWhole) {
  const TestScene s = room(64, 64);
  const RenderSettings settings = settings_for(s.scene, GetParam(), 32, 6);
  Film whole(settings.grid);
  whole.fold(render_partial(s.scene, settings));
  const Renderer renderer(s.scene, settings, 1);
  Film halves[2] = {Film(settings.grid), Film(settings.grid)};
  for (int64_t h = 0; h < 2; ++h) halves[h].fold(render_samples(renderer, 16 * h, 16 * h + 16));
  const Image image = whole.resolve(), first = halves[0].resolve(), second = halves[1].resolve();
  // The mean of the halves, up to float rounding of the resolved images.
  for (size_t i = 0; i < image.data.size(); ++i) {
    const float mean = 0.5f * (first.data[i] + second.data[i]);
    ASSERT_NEAR(image.data[i], mean, 1e-5f * (1 + mean));
  }
}

INSTANTIATE_TEST_SUITE_P(All, Determinism,
                         ::testing::Values(Integrator::kPt, Integrator::kBdpt, Integrator::kLt),
                         [](const auto& info) { return name_of(info.param); });

}  // namespace
}  // namespace lightmill::test
