// Scaling a scene by 2^k leaves the bits of the image alone; translating it leaves the image within its
// interval.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/agreement.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

/// Everything at once: triangles and spheres, all kinds of materials, area and point lights.
TestScene everything() {
  TestScene s = cornell_room();
  s.sphere({-0.5, -0.6, 0.4}, 0.3, s.dielectric(1.5f, 0));
  s.sphere({0.35, -0.2, 0.5}, 0.2, s.conductor(0.9f, 0.2f));
  s.sphere({-0.4, 0.3, 0.8}, 0.15, s.coated({0.2f, 0.3f, 0.8f}, 1.5f, 0));
  s.quad({-0.9, -0.9, 0.9}, {0, 0.8, 0.05}, {0.8, 0, 0}, s.conductor(0.8f, 0));
  s.sphere({0.7, 0.6, 0.6}, 0.05, s.diffuse(0), {.radiance = {20, 10, 5}});
  s.point_light({-0.6, 0.5, -0.3}, {0.2f, 0.3f, 0.4f});
  return s;
}

/// The scene 2^k times as large: lengths through the transforms, intensities with the square (radiance
/// stays).
SceneDescription scaled_scene(const SceneDescription& scene, int k) {
  SceneDescription out = scene;
  for (ShapeDescription& s : out.shapes) {
    for (size_t i = 0; i < 3; ++i) {
      for (double& x : s.object_to_world.m[i]) x = std::ldexp(x, k);
    }
  }
  for (LightDescription& l : out.lights) {
    if (auto* p = std::get_if<PointLight>(&l.kind)) {
      p->position = p->position * std::ldexp(1.0, k);
      const float f = std::ldexp(1.0f, 2 * k);
      p->intensity = {p->intensity.r * f, p->intensity.g * f, p->intensity.b * f};
    }
  }
  for (size_t i = 0; i < 3; ++i)
    out.camera.camera_to_world.m[i][3] = std::ldexp(out.camera.camera_to_world.m[i][3], k);
  return out;
}

/// The same by the vertices themselves.
SceneDescription scaled_vertices(const SceneDescription& scene, int k) {
  SceneDescription out = scaled_scene(scene, k);
  for (size_t i = 0; i < out.shapes.size(); ++i) {
    const auto* mesh = std::get_if<MeshShape>(&scene.shapes[i].kind);
    if (!mesh) continue;
    out.shapes[i].object_to_world = scene.shapes[i].object_to_world;
    TriangleMesh copy = *mesh->mesh;
    for (Vec3f& v : copy.positions) v = {std::ldexp(v.x, k), std::ldexp(v.y, k), std::ldexp(v.z, k)};
    out.shapes[i].kind = MeshShape{std::make_shared<TriangleMesh>(std::move(copy))};
  }
  return out;
}

class Scale : public ::testing::TestWithParam<Integrator> {};

TEST_P(Scale, PowersOfTwoLeaveTheBitsAlone) {
  const TestScene s = everything();
  const auto render = [](const SceneDescription& scene) {
    return render_batches(scene, settings_for(scene, GetParam(), 16, 8), 1);
  };
  const Batches original = render(s.scene);
  EXPECT_EQ(original.counters.nonfinite, 0u);
  double sum = 0;
  for (const float x : original.images[0].data) sum += x;
  EXPECT_GT(sum, 0);
  for (int k = -60; k <= 60; k += 20) {
    if (k == 0) continue;
    EXPECT_EQ(render(scaled_scene(s.scene, k)).images[0].data, original.images[0].data) << "2^" << k;
  }
  for (const int k : {-40, 40}) {
    EXPECT_EQ(render(scaled_vertices(s.scene, k)).images[0].data, original.images[0].data)
        << "vertices, 2^" << k;
  }
}

INSTANTIATE_TEST_SUITE_P(All, Scale, ::testing::Values(Integrator::kPt, Integrator::kBdpt, Integrator::kLt),
                         [](const auto& info) { return name_of(info.param); });

TEST(Scale, TheEnvironmentToo) {
  TestScene s;
  s.sphere({0, 0, 0}, 1, s.coated({0.6f, 0.5f, 0.4f}, 1.5f, 0.3f)).environment({1, 2, 3});
  s.camera({0, 1, -4}, {0, 0, 0}, 30).film(32, 32);
  const auto render = [](const SceneDescription& scene) {
    return render_batches(scene, settings_for(scene, Integrator::kBdpt, 16, 5), 1).images[0].data;
  };
  const auto original = render(s.scene);
  for (int k = -60; k <= 60; k += 30) EXPECT_EQ(render(scaled_scene(s.scene, k)), original) << "2^" << k;
}

// Family-wise alpha = 1e-4 over all 8x8 blocks and channels, other seeds: object-space floats under a double
// transform keep their bits, so even 10^9 times the scene's size away costs nothing.
TEST(Translate, PowersOfTenStayWithinTheInterval) {
  const TestScene s = everything();
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
