// Lenses: where they focus, what their weights are, and that no ray outside of the exit pupil's bounds gets
// through.
#include "worker/render/camera/lens_stack.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/base/error.h"
#include "tests/support/statistics.h"
#include "tests/support/test_scene.h"
#include "worker/render/camera/realistic.h"

namespace lightmill::test {
namespace {

LensSystem landscape_lens() {
  LensSystem lens;
  lens.elements = {{52, 6, 1.62, 28}, {-52, 3, 1, 28}, {0, 4, 0, 20}, {-90, 2, 1.7, 24}, {90, 3, 1, 24}};
  lens.aperture_diameter = 3;
  lens.focus_distance = 2;
  return lens;
}

RealisticCamera camera_of(const LensSystem& lens, int width = 60, int height = 40) {
  TestScene s;
  s.camera({0, 0, 0}, {0, 0, 1}, 50);
  s.scene.camera.kind = CameraKind::kRealistic;
  s.scene.camera.lens = lens;
  return RealisticCamera(s.scene.camera, width, height, 0);
}

// Rays of the film's centre meet on the axis at the focus distance: a near to it, as lenses of spheres are
// sharp there alone.
TEST(LensStack, FocusesAtItsDistance) {
  for (const double focus : {0.5, 2.0, 20.0}) {
    LensSystem lens = landscape_lens();
    lens.focus_distance = focus;
    const LensStack stack = build_lenses(lens);
    const float rear = stack.interfaces.front().z;
    int through = 0;
    for (int i = 1; i <= 20; ++i) {
      Vec3<float> o{0, 0, 0}, d{static_cast<float>(i) * 1e-5f, 0, rear};
      if (trace_lenses<float>(stack, &o, &d, true) == 0) continue;
      ++through;
      // In steps of the slope, as rays are nearly parallel for a far focus.
      const double slope = -double{d.x} / double{d.z}, expected = double{o.x} / (focus - double{o.z});
      EXPECT_NEAR(slope, expected, 0.03 * std::fabs(expected) + 2e-6) << focus << " ray " << i;
    }
    EXPECT_EQ(through, 20);
  }
}

TEST(LensStack, RefusesWhatCanNotBeSharp) {
  LensSystem lens = landscape_lens();
  lens.focus_distance = 0.05;
  EXPECT_THROW(build_lenses(lens), Error);
  lens = landscape_lens();
  for (LensElement& e : lens.elements) e.eta = 1;
  EXPECT_THROW(build_lenses(lens), Error);
}

TEST(LensStack, NoRayOutsideOfThePupilsBoundsGetsThrough) {
  LensSystem lens = landscape_lens();
  lens.aperture_diameter = 14;
  const LensStack stack = build_lenses(lens);
  const double half = 0.0175;
  const std::vector<PupilBounds> pupils = exit_pupils(stack, half);
  ASSERT_EQ(pupils.size(), size_t{kPupils});
  Random random(1);
  int inside = 0, outside = 0;
  for (int i = 0; i < 200000; ++i) {
    const auto r = static_cast<float>(random.between(0, half));
    const PupilBounds& b = pupils[static_cast<size_t>(r / half * kPupils)];
    const auto x = static_cast<float>(random.between(-0.013, 0.013)),
               y = static_cast<float>(random.between(-0.013, 0.013));
    Vec3<float> o{r, 0, 0}, d{x - r, y, stack.interfaces.front().z};
    if (trace_lenses<float>(stack, &o, &d, true) == 0) continue;
    ++(x >= b.x0 && x <= b.x1 && y >= b.y0 && y <= b.y1 ? inside : outside);
  }
  EXPECT_GT(inside, 10000);
  EXPECT_LE(outside, inside / 10000);
}

// Of a film point on the axis the mean weight is the irradiance from a unit sky: pi sin^2 of the exit pupil's
// half angle, over the squared distance of the rear, as pbrt has it.
TEST(LensStack, WeightsAreTheIrradianceOfTheFilm) {
  LensSystem lens = landscape_lens();
  const RealisticCamera camera = camera_of(lens);
  const LensStack stack = build_lenses(lens);
  const float rear = stack.interfaces.front().z;
  float edge = 0;
  for (float x = 0; x < 0.02f; x += 1e-6f) {
    Vec3<float> o{0, 0, 0}, d{x, 0, rear};
    if (trace_lenses<float>(stack, &o, &d, true) > 0) edge = x;
  }
  const double sin2 = double{edge} * edge / (double{edge} * edge + double{rear} * rear);
  Random random(2);
  double sum = 0;
  constexpr int kSamples = 100000;
  for (int i = 0; i < kSamples; ++i)
    sum += double{camera.ray(30.0f, 20.0f, random.uniform(), random.uniform()).weight};
  EXPECT_NEAR(sum / kSamples / (M_PI * sin2), 1, 0.01);
}

TEST(LensStack, PicturesStandUprightAndStopsKeepTheLight) {
  const RealisticCamera camera = camera_of(landscape_lens());
  const auto right_and_up = camera.ray(50.0f, 5.0f, 0.5f, 0.5f);
  ASSERT_GT(right_and_up.weight, 0);
  TestScene s;
  s.camera({0, 0, 0}, {0, 0, 1}, 50);
  const Vec3d right{s.scene.camera.camera_to_world.m[0][0], 0, 0};
  EXPECT_GT(double{right_and_up.direction.x} * right.x, 0);
  EXPECT_GT(right_and_up.direction.y, 0);
  for (const char* shape : {"gaussian", "square", "pentagon", "star"}) {
    LensSystem lens = landscape_lens();
    lens.aperture = shape;
    const LensStack stack = build_lenses(lens);
    double sum = 0;
    constexpr int kSide = 400;
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x)
        sum += double{stack.stop_at(-1 + 2 * (static_cast<float>(x) + 0.5f) / kSide,
                                    -1 + 2 * (static_cast<float>(y) + 0.5f) / kSide)};
    }
    EXPECT_NEAR(sum / (kSide * kSide), M_PI / 4, 0.005) << shape;
    EXPECT_EQ(stack.stop_at(1.5f, 0), 0);
  }
}

TEST(LensStack, LanesHaveTheBitsOfScalars) {
  LensSystem lens = landscape_lens();
  lens.aperture_diameter = 12;
  const LensStack stack = build_lenses(lens);
  Random random(4);
  for (int round = 0; round < 500; ++round) {
    Vec3<Float8> o{}, d{};
    for (int l = 0; l < 8; ++l) {
      o.x[l] = static_cast<float>(random.between(-0.015, 0.015));
      o.y[l] = static_cast<float>(random.between(-0.01, 0.01));
      d.x[l] = static_cast<float>(random.between(-0.01, 0.01)) - o.x[l];
      d.y[l] = static_cast<float>(random.between(-0.01, 0.01)) - o.y[l];
      d.z[l] = stack.interfaces.front().z;
    }
    const Vec3<Float8> start = o, towards = d;
    const Float8 weight = trace_lenses<Float8>(stack, &o, &d, splat_mask<Float8>(true));
    for (int l = 0; l < 8; ++l) {
      Vec3<float> so{start.x[l], start.y[l], start.z[l]}, sd{towards.x[l], towards.y[l], towards.z[l]};
      const float w = trace_lenses<float>(stack, &so, &sd, true);
      ASSERT_EQ(float_bits(w), float_bits(float{weight[l]}));
      if (w == 0) continue;
      ASSERT_EQ(float_bits(sd.x), float_bits(float{d.x[l]}));
      ASSERT_EQ(float_bits(so.y), float_bits(float{o.y[l]}));
    }
  }
}

}  // namespace
}  // namespace lightmill::test
