// Scaling a scene by 2^k leaves the bits of the image alone; translating it leaves the image
// within its interval.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "common/image/image.h"
#include "tests/support/agreement.h"
#include "tests/support/scaled_scene.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

/// A closed scaled_room, whose noise is small.
TestScene scaled_room() {
  TestScene s = cornell_room();
  s.sphere({-0.5, -0.6, 0.4}, 0.3, s.dielectric(1.5f, 0));
  s.sphere({0.35, -0.2, 0.5}, 0.2, s.conductor(0.9f, 0.2f));
  s.sphere({-0.4, 0.3, 0.8}, 0.15, s.coated({0.2f, 0.3f, 0.8f}, 1.5f, 0));
  s.quad({-0.9, -0.9, 0.9}, {0, 0.8, 0.05}, {0.8, 0, 0}, s.conductor(0.8f, 0));
  s.sphere({0.7, 0.6, 0.6}, 0.05, s.diffuse(0), {.radiance = {20, 10, 5}});
  s.point_light({-0.6, 0.5, -0.3}, {0.2f, 0.3f, 0.4f});
  return s;
}

/// Something of every kind, its environment an image; the file lives as long as this.
class Scale : public ::testing::Test {
 protected:
  Scale() : folder_((std::filesystem::temp_directory_path() / "lightmill-XXXXXX").string()) {
    if (!mkdtemp(folder_.data())) throw std::runtime_error("no temporary folder");
    Image sky(4, 4);
    for (size_t i = 0; i < sky.data.size(); ++i) sky.data[i] = static_cast<float>((i / 3 * 7) % 11);
    write_image(sky, folder_ + "/sky.exr");
    scene_ = scene_of_everything(folder_ + "/sky.exr").scene;
  }
  ~Scale() override { std::filesystem::remove_all(folder_); }

  static std::vector<float> render(const SceneDescription& scene, Integrator integrator) {
    const Batches b = render_batches(scene, settings_for(scene, integrator, 16, 8), 1);
    EXPECT_EQ(b.counters.nonfinite, 0u);
    return b.images[0].data;
  }
  void expect_equal_bits(std::initializer_list<int> powers, const char* camera) const {
    for (const Integrator i : {Integrator::kPt, Integrator::kBdpt, Integrator::kLt}) {
      const std::vector<float> original = render(scene_, i);
      const auto lit = std::count_if(original.begin(), original.end(), [](float x) { return x > 0; });
      EXPECT_GT(lit, 100) << camera;
      for (const int k : powers)
        EXPECT_EQ(render(scaled_scene(scene_, k), i), original)
            << camera << ", 2^" << k << ", " << name_of(i);
    }
  }

  std::string folder_;
  SceneDescription scene_;
};

TEST_F(Scale, PowersOfTwoLeaveTheBitsAlone) {
  expect_equal_bits({-60, -47, -30, -1, 1, 30, 47, 60}, "perspective");
  for (const Integrator i : {Integrator::kPt, Integrator::kBdpt, Integrator::kLt}) {
    const std::vector<float> original = render(scene_, i);
    for (const int k : {-40, 40})
      EXPECT_EQ(render(scaled_vertices(scene_, k), i), original) << "vertices, 2^" << k;
  }
}

TEST_F(Scale, EveryCamera) {
  CameraDescription& c = scene_.camera;
  c.lens_radius = 0.05;
  c.focal_distance = 1.3;
  expect_equal_bits({-60, 60}, "thin lens");
  c.lens_radius = 0;
  c.kind = CameraKind::kOrthographic;
  c.screen_window = std::array<double, 4>{-0.9, 0.9, -0.9, 0.9};
  expect_equal_bits({-60, 60}, "orthographic");
  c.kind = CameraKind::kSpherical;
  c.screen_window.reset();
  for (const SphericalMapping mapping : {SphericalMapping::kEqualArea, SphericalMapping::kEquirectangular}) {
    c.mapping = mapping;
    expect_equal_bits({-60, 60}, "spherical");
  }
}

// Family-wise alpha = 1e-4 over all 8x8 blocks and channels, other seeds: object-space floats under a double
// transform keep their bits, so even 10^9 times the scene's size away costs nothing.
TEST(Translate, PowersOfTenStayWithinTheInterval) {
  const TestScene s = scaled_room();
  const Batches original = render_batches(s.scene, settings_for(s.scene, Integrator::kPt, 512, 4, 1), 16);
  for (const int k : {1, 3, 6, 9}) {
    SceneDescription moved = s.scene;
    const Vec3d by = Vec3d{1, -0.7, 0.3} * std::pow(10.0, k);
    for (ShapeDescription& shape : moved.shapes) {
      shape.object_to_world.m[0][3] += by.x;
      shape.object_to_world.m[1][3] += by.y;
      shape.object_to_world.m[2][3] += by.z;
    }
    for (LightDescription& l : moved.lights) {
      auto& p = std::get<PointLight>(l.kind);
      p.position = p.position + by;
    }
    for (size_t i = 0; i < 3; ++i)
      moved.camera.camera_to_world.m[i][3] += (i == 0 ? by.x : i == 1 ? by.y : by.z);
    const Batches b = render_batches(moved, settings_for(moved, Integrator::kPt, 512, 4, 2), 16);
    EXPECT_EQ(b.counters.nonfinite, 0u);
    EXPECT_TRUE(images_agree(original, b)) << "10^" << k;
    EXPECT_TRUE(means_agree(original.mean(), b.mean(), {.resolution = 0.03})) << "10^" << k;
    EXPECT_FALSE(means_agree(original.mean(), scaled(b, 1.05f).mean(), {.resolution = 0.03}));
  }
}

}  // namespace
}  // namespace lightmill::test
