// Every camera through the whole renderer: the three integrators agree, an emissive wall shows its radiance
// in every pixel (the camera's importance integrates to one), powers of two leave the bits alone, and a thin
// lens blurs as its circle of confusion says. Fixed seeds.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/agreement.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

enum class Kind { kPinhole, kThinLens, kOrthographic, kParallelLens, kEqualArea, kEquirectangular };

struct CameraCase {
  const char* name;
  Kind kind;
};

/// Sets the camera's kind. `size`: the scene's.
void set_camera(CameraDescription& camera, Kind kind, double size) {
  switch (kind) {
    case Kind::kPinhole:
      break;
    case Kind::kThinLens:
      camera.lens_radius = 0.08 * size;
      camera.focal_distance = 1.1 * size;
      break;
    case Kind::kEqualArea:
      camera.kind = CameraKind::kSpherical;
      break;
    case Kind::kEquirectangular:
      camera.kind = CameraKind::kSpherical;
      camera.mapping = SphericalMapping::kEquirectangular;
      break;
    case Kind::kParallelLens:
      camera.lens_radius = 0.08 * size;
      camera.focal_distance = 1.1 * size;
      [[fallthrough]];
    case Kind::kOrthographic:
      camera.kind = CameraKind::kOrthographic;
      camera.screen_window = std::array<double, 4>{-0.9 * size, 0.8 * size, -0.85 * size, 0.9 * size};
      break;
  }
}

class CameraImage : public ::testing::TestWithParam<CameraCase> {};

// Family-wise alpha 1e-4 over all 8x8 blocks and channels. The room has a block, walls in and out of focus
// and a lamp; blocks resolve about 10 %, the whole image 1 %.
TEST_P(CameraImage, PtBdptAndLtAgree) {
  TestScene s = cornell_room();
  s.sphere({-0.4, -0.3, 0}, 0.3, s.conductor(0.9f, 0.3f));
  // Wide enough that what a splat loses or gains at the raster's edge would show.
  s.scene.filter = {FilterKind::kTriangle, 4, 4, 0};
  set_camera(s.scene.camera, GetParam().kind, 1);
  const Batches pt = render_batches(s.scene, settings_for(s.scene, Integrator::kPt, 512, 4, 1), 16);
  const Batches bdpt = render_batches(s.scene, settings_for(s.scene, Integrator::kBdpt, 256, 4, 2), 16);
  const Batches lt = render_batches(s.scene, settings_for(s.scene, Integrator::kLt, 1024, 4, 3), 16);
  for (const Batches* b : {&pt, &bdpt, &lt}) EXPECT_EQ(b->counters.nonfinite, 0u);
  EXPECT_TRUE(images_agree(pt, bdpt));
  EXPECT_TRUE(images_agree(pt, lt, {.max_excluded = 0.3}));
  EXPECT_TRUE(means_agree(pt.mean(), bdpt.mean(), {.resolution = 0.02}));
  EXPECT_TRUE(means_agree(pt.mean(), lt.mean(), {.resolution = 0.02}));
  EXPECT_FALSE(means_agree(pt.mean(), scaled(bdpt, 1.04f).mean(), {.resolution = 0.02}));
}

// The same under filters with negative lobes and a sensor whose colours may come out negative.
TEST(FilmImage, SignedSumsAgreeAndKeepAnEvenLight) {
  TestScene s = cornell_room();
  for (const FilterKind kind : {FilterKind::kMitchell, FilterKind::kSinc}) {
    s.scene.filter.kind = kind;
    s.scene.filter.xradius = s.scene.filter.yradius = kind == FilterKind::kSinc ? 4 : 2;
    s.scene.film.sensor = {0.9, -0.2, 0, 0, 1.1, -0.1, 0, 0, 1.5};
    const Batches pt = render_batches(s.scene, settings_for(s.scene, Integrator::kPt, 4096, 4, 1), 16);
    const Batches bdpt = render_batches(s.scene, settings_for(s.scene, Integrator::kBdpt, 1024, 4, 2), 16);
    EXPECT_EQ(pt.counters.nonfinite + bdpt.counters.nonfinite, 0u);
    for (int c = 0; c < 3; ++c) EXPECT_TRUE(means_agree(pt.mean(c), bdpt.mean(c), {.resolution = 0.03})) << c;
  }
  TestScene box;
  box.box({-3, -2, -4}, {3, 2, 4}, box.diffuse(0), {.radiance = {1, 2, 4}, .inward = true});
  box.camera({0.3, 0.2, -1}, {0, 0, 3}, 60).film(24, 16);
  box.scene.filter = s.scene.filter;
  box.scene.film.sensor = s.scene.film.sensor;
  const Batches b = render_batches(box.scene, settings_for(box.scene, Integrator::kPt, 4096, 0), 16);
  const double expected[3] = {0.9 - 0.4, 2.2 - 0.4, 6};
  for (int c = 0; c < 3; ++c) EXPECT_TRUE(mean_is(b.mean(c), expected[c], {.resolution = 0.015})) << c;
}

// Samples are held to the largest component of their XYZ.
TEST(FilmImage, SamplesAreLimited) {
  TestScene box;
  box.box({-3, -2, -4}, {3, 2, 4}, box.diffuse(0), {.radiance = {0, 2, 0}, .inward = true});
  box.camera({0.3, 0.2, -1}, {0, 0, 3}, 60).film(8, 8);
  for (const double most : {0.5, 5.0}) {
    box.scene.film.most = most;
    const Batches b = render_batches(box.scene, settings_for(box.scene, Integrator::kPt, 16, 0), 1);
    EXPECT_NEAR(b.images[0].data[1], std::min(2.0, most / 0.7151687), 1e-4);
  }
}

// Research oracle 16: inside a closed emitter of radiance L every pixel is L, whatever the camera.
TEST_P(CameraImage, AnEmissiveBoxShowsItsRadianceInEveryPixel) {
  TestScene s;
  s.box({-3, -2, -4}, {3, 2, 4}, s.diffuse(0), {.radiance = {1, 2, 4}, .inward = true});
  s.camera({0.3, 0.2, -1}, {0, 0, 3}, 60).film(24, 16);
  set_camera(s.scene.camera, GetParam().kind, 1.8);
  const Image exact = render_batches(s.scene, settings_for(s.scene, Integrator::kPt, 16, 0), 1).images[0];
  for (size_t i = 0; i < exact.data.size(); ++i) EXPECT_NEAR(exact.data[i], 1 << i % 3, 1e-5);
  const Batches lt = render_batches(s.scene, settings_for(s.scene, Integrator::kLt, 65536, 0), 16);
  EXPECT_EQ(lt.counters.nonfinite, 0u);
  for (int y = 0; y < 16; y += 4) {
    for (int x = 0; x < 24; x += 4) {
      EXPECT_TRUE(mean_is(lt.mean({x, y, x + 4, y + 4}, 1), 2, {.alpha = 1e-5, .resolution = 0.15}))
          << x << ' ' << y;
    }
  }
  EXPECT_TRUE(mean_is(lt.mean(1), 2, {.resolution = 0.02}));
}

// What light paths bring to the rest of the image is not the crop window's.
TEST_P(CameraImage, ACropWindowHasItsOwnLightAlone) {
  TestScene s;
  s.box({-3, -2, -4}, {3, 2, 4}, s.diffuse(0), {.radiance = {1, 2, 4}, .inward = true});
  s.camera({0.3, 0.2, -1}, {0, 0, 3}, 60).film(32, 16);
  set_camera(s.scene.camera, GetParam().kind, 1.8);
  s.scene.film.crop = {0.25, 0.75, 0.25, 0.75};
  for (const double radius : {0.5, 1.5}) {
    s.scene.filter = {FilterKind::kBox, radius, radius, 0};
    const Batches lt = render_batches(s.scene, settings_for(s.scene, Integrator::kLt, 65536, 0), 16);
    EXPECT_TRUE(mean_is(lt.mean(1), 2, {.resolution = 0.03})) << radius;
    EXPECT_TRUE(mean_is(lt.mean({0, 0, 16, 1}, 1), 2, {.resolution = 0.06})) << radius << ", its edge";
  }
}

TEST_P(CameraImage, PowersOfTwoLeaveTheBitsAlone) {
  const auto render = [](int k) {
    TestScene s = cornell_room();
    CameraDescription& camera = s.scene.camera;
    set_camera(camera, GetParam().kind, std::ldexp(1.0, k));
    for (ShapeDescription& shape : s.scene.shapes) {
      for (size_t i = 0; i < 3; ++i) {
        for (double& x : shape.object_to_world.m[i]) x = std::ldexp(x, k);
      }
    }
    for (size_t i = 0; i < 3; ++i)
      camera.camera_to_world.m[i][3] = std::ldexp(camera.camera_to_world.m[i][3], k);
    return render_batches(s.scene, settings_for(s.scene, Integrator::kBdpt, 16, 4), 1).images[0].data;
  };
  const auto original = render(0);
  for (const int k : {-60, -3, 60}) EXPECT_EQ(render(k), original) << "2^" << k;
}

INSTANTIATE_TEST_SUITE_P(All, CameraImage,
                         ::testing::Values(CameraCase{"pinhole", Kind::kPinhole},
                                           CameraCase{"thin_lens", Kind::kThinLens},
                                           CameraCase{"orthographic", Kind::kOrthographic},
                                           CameraCase{"orthographic_lens", Kind::kParallelLens},
                                           CameraCase{"equal_area", Kind::kEqualArea},
                                           CameraCase{"equirectangular", Kind::kEquirectangular}),
                         [](const auto& info) { return info.param.name; });

/// Total and variance along x, in pixels^2, of an image's light.
double variance_x(const Image& image) {
  double sum = 0, first = 0, second = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const double w = image.data[static_cast<size_t>(3 * (y * image.width + x))];
      sum += w;
      first += w * x;
      second += w * x * x;
    }
  }
  return second / sum - first / sum * (first / sum);
}

// A source of radius r at depth z through a lens of radius R focused at f: on the image plane at distance 1
// the lens's disk maps to a disk of radius R |1/f - 1/z|, whose variance along an axis is a quarter of its
// square; the source adds (r/z)^2 / 4 and a pixel of width p adds p^2 / 12.
TEST(ThinLensImage, BlurIsTheCircleOfConfusion) {
  constexpr int kPixels = 128;
  constexpr double kDepth = 4, kSource = 0.005, kLens = 0.1;
  for (const Integrator integrator : {Integrator::kLt, Integrator::kPt}) {
    const bool lt = integrator == Integrator::kLt;
    const double source = lt ? kSource : 16 * kSource;  // camera paths must find it
    for (const double focus : {1.5, 2.0, 4.0, 9.0, 1e6}) {
      TestScene s;
      s.sphere({0, 0, kDepth}, source, s.diffuse(0), {.radiance = {1, 1, 1}});
      s.camera({0, 0, 0}, {0, 0, 1}, 20).film(kPixels, kPixels);
      s.scene.camera.lens_radius = kLens;
      s.scene.camera.focal_distance = focus;
      const Batches b = render_batches(s.scene, settings_for(s.scene, integrator, lt ? 256 : 512, 0), 16);
      const double pixel = 2 * std::tan(M_PI / 18) / kPixels;
      const double confusion = kLens * std::fabs(1 / focus - 1 / kDepth), width = source / kDepth;
      const double expected = (confusion * confusion + width * width) / 4 / (pixel * pixel) + 1.0 / 12;
      if (focus == kDepth && lt) {
        // The source is smaller than a pixel and sits on a corner of four: they have all the light.
        double near = 0, all = 0;
        for (int y = 0; y < kPixels; ++y) {
          for (int x = 0; x < kPixels; ++x) {
            const double w = b.images[0].data[static_cast<size_t>(3 * (y * kPixels + x))];
            all += w;
            if (std::abs(2 * x + 1 - kPixels) == 1 && std::abs(2 * y + 1 - kPixels) == 1) near += w;
          }
        }
        EXPECT_GT(all, 0);
        EXPECT_NEAR(near / all, 1, 1e-6);
        continue;
      }
      EXPECT_TRUE(mean_is(b.of(variance_x), expected, {.resolution = 0.05, .rounding = 5e-3}))
          << name_of(integrator) << " focus " << focus;
    }
  }
}

}  // namespace
}  // namespace lightmill::test
