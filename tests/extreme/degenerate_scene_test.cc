// Scenes without something that scenes usually have.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/render.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

class Degenerate : public ::testing::TestWithParam<Integrator> {
 protected:
  Batches render(const TestScene& s, int max_depth, int64_t spp, int batches = 1) const {
    Batches b = render_batches(s.scene, settings_for(s.scene, GetParam(), spp, max_depth), batches);
    EXPECT_EQ(b.counters.nonfinite, 0u);
    return b;
  }
  static bool black(const Image& image) {
    return std::all_of(image.data.begin(), image.data.end(), [](float x) { return x == 0; });
  }
};

TEST_P(Degenerate, EmptySceneIsBlack) {
  TestScene s;
  s.film(40, 30);
  EXPECT_TRUE(black(render(s, 5, 16).images[0]));
}

TEST_P(Degenerate, NothingButTheEnvironment) {
  TestScene s;
  s.environment({1, 2, 3}).film(16, 16);
  const Batches b = render(s, 5, 16);
  if (GetParam() == Integrator::kLt) {
    EXPECT_TRUE(black(b.images[0]));  // the environment has no point that could be joined to the lens
  } else {
    EXPECT_NEAR(b.mean(0).mean, 1, 1e-6);
    EXPECT_NEAR(b.mean(2).mean, 3, 1e-6);
  }
}

TEST_P(Degenerate, NoLightsIsBlack) {
  TestScene s;
  s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(0.9f)).sphere({0, 0, 0.5}, 0.2, s.dielectric(1.5f, 0));
  s.camera({0, 0, -0.5}, {0, 0, 1}, 60);
  EXPECT_TRUE(black(render(s, kUnlimitedDepth, 16).images[0]));
}

TEST_P(Degenerate, LightThatEmitsNothing) {
  TestScene s;
  s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(0.9f)).point_light({0, 0, 0}, {0, 0, 0});
  s.camera({0, 0, -0.5}, {0, 0, 1}, 60);
  EXPECT_TRUE(black(render(s, 5, 16).images[0]));
}

TEST_P(Degenerate, CameraInsideAnOpaqueObject) {
  TestScene s;
  s.sphere({0, 0, 0}, 1, s.diffuse(0.9f)).environment({1, 1, 1}).point_light({0, 3, 0}, {50, 50, 50});
  s.camera({0.1, 0.2, 0.3}, {1, 0, 0}, 60);
  EXPECT_TRUE(black(render(s, 5, 64).images[0]));
}

TEST_P(Degenerate, CameraOnASurface) {
  TestScene s;
  s.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, s.diffuse(0.5f)).point_light({0.2, 1, 0}, {1, 1, 1});
  s.camera({0, 0, 0}, {0.3, -0.2, 1}, 60).film(32, 32);
  render(s, 5, 16);  // nothing sensible to see: it must only stay finite
}

TEST_P(Degenerate, LightAtTheCamera) {
  TestScene s;
  s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(0.5f))
      .point_light({0, 0, 0}, {1, 1, 1})
      .camera({0, 0, 0}, {0, 0, 1}, 60);
  EXPECT_GT(render(s, 5, 64).mean().mean, 0);
}

TEST_P(Degenerate, NeedlesAndCoincidentSurfaces) {
  TestScene s = cornell_room();
  const int m = s.diffuse(0.5f), glass = s.dielectric(1.5f, 0.2f);
  s.triangle({-1, -0.5, 0.5}, {1, -0.5, 0.5}, {0, -0.4999999, 0.5}, m,
             {.radiance = {100, 100, 100}, .two_sided = true});
  s.triangle({0, 0, 0.3}, {1e-12, 0, 0.3}, {0, 1e-12, 0.3}, m, {.radiance = {1, 1, 1}});
  s.quad({-0.5, -0.9, 0.2}, {0, 0.4, 0}, {0.4, 0, 0}, m)
      .quad({-0.5, -0.9, 0.2}, {0, 0.4, 0}, {0.4, 0, 0}, glass);
  s.sphere({0.3, 0, 0.5}, 0.2, glass).sphere({0.3, 0, 0.5}, 0.2, m);
  render(s, 10, 32);
}

// A closed emissive box is Le / (1 - rho) in every pixel of every shape of film.
TEST_P(Degenerate, OnePixelAndOneColumn) {
  struct Size {
    int width, height;
    int64_t spp;
  };
  for (const Size size : {Size{1, 1, 16384}, Size{1, 20000, 16}, Size{20000, 1, 16}, Size{33, 31, 32}}) {
    TestScene s;
    s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(0.5f), {.radiance = {1, 1, 1}, .inward = true});
    s.camera({0.1, 0, 0.2}, {1, 0.3, 1}, 40).film(size.width, size.height);
    const double frame = static_cast<double>(size.width) / size.height;
    if (frame < 0.01 || frame > 100) {
      // A sane field of view along the film's long side.
      s.scene.camera.screen_window = std::array<double, 4>{-1, 1, -1, 1};
    }
    const Batches b = render(s, kUnlimitedDepth, size.spp);
    EXPECT_EQ(b.images[0].width, size.width);
    EXPECT_EQ(b.images[0].height, size.height);
    EXPECT_NEAR(b.mean().mean, 2, GetParam() == Integrator::kLt ? 0.15 : 0.05)
        << size.width << "x" << size.height;
  }
}

/// For the integrators that start at the camera: no light path lands in a view this flat.
class GrazingView : public Degenerate {};

// A camera that grazes a floor in a constant environment sees rho L0 down to the horizon.
TEST_P(GrazingView, SeesTheFloorToTheHorizon) {
  for (const double height : {1e-2, 1e-4, 1e-6}) {
    TestScene s;
    s.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, s.diffuse(0.6f)).environment({1, 1, 1});
    const double angle = height / 0.5;  // looks at a point half a unit ahead
    s.camera({0, height, -0.5}, {0, 0, 0}, angle * 180 / M_PI * 0.8).film(8, 8);
    EXPECT_TRUE(mean_is(render(s, 3, 256, 16).mean(), 0.6, {.resolution = 0.03, .rounding = 1e-4})) << height;
  }
}

INSTANTIATE_TEST_SUITE_P(All, GrazingView, ::testing::Values(Integrator::kPt, Integrator::kBdpt),
                         [](const auto& info) { return name_of(info.param); });
INSTANTIATE_TEST_SUITE_P(All, Degenerate,
                         ::testing::Values(Integrator::kPt, Integrator::kBdpt, Integrator::kLt),
                         [](const auto& info) { return name_of(info.param); });

}  // namespace
}  // namespace lightmill::test
