// Images that are looked up by a mesh's second set of texture coordinates: as colours, on emitters, as alpha.
#include <gtest/gtest.h>

#include "common/image/image.h"
#include "common/scene/texture_graph/graph_builder.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_scene.h"
#include "worker/render/scene/geometry/alpha_mask.h"
#include "worker/render/scene/geometry/surface.h"
#include "worker/render/scene/lights/emitter_pattern.h"

namespace lightmill::test {
namespace {

/// A quad at z = 2 that shows a picture, dark on the left and bright on the right: by its uvs all of it, by
/// the second ones the bright half alone.
class SecondUvs : public ::testing::Test {
 protected:
  SecondUvs() {
    Image image(2, 1);
    for (int c = 0; c < 3; ++c) image.pixel(0, 0)[c] = 0, image.pixel(1, 0)[c] = 0.75f;
    write_image(image, folder_.file("halves.exr"));
    for (const bool second : {false, true}) {
      ImageTexture t;
      t.path = folder_.file("halves.exr");
      t.filter = TexelFilter::kNearest;
      t.second_uvs = second;
      s_.scene.textures.push_back({"", true, t, {}});
    }
    s_.quad({-1, -1, 2}, {2, 0, 0}, {0, 2, 0}, s_.diffuse(0.5f)).camera({0, 0, 0}, {0, 0, 1}, 60);
    auto mesh = std::make_shared<TriangleMesh>(*std::get<MeshShape>(s_.scene.shapes[0].kind).mesh);
    for (const Vec3f& p : mesh->positions) {
      mesh->uvs.push_back({(p.x + 1) / 2, (p.y + 1) / 2});
      mesh->second_uvs.push_back({0.5f + (p.x + 1) / 4, (p.y + 1) / 2});
    }
    s_.scene.shapes[0].kind = MeshShape{mesh};
  }
  ShapeDescription& shape() { return s_.scene.shapes[0]; }
  void reflect(int texture) {
    DiffuseMaterial m;
    m.reflectance.texture = texture;
    s_.scene.materials[static_cast<size_t>(shape().material)].kind = m;
  }
  /// The surface that the ray (x, 0, 1) meets.
  static TexturePoint point(const RenderScene& scene, float x) {
    const Vec3<float> d = normalize(Vec3<float>{x, 0.01f, 2});
    int32_t prim = 0;
    for (int32_t i = 0; i < scene.triangle_count(); ++i) {
      const TriangleHit<float> h = triangle_hit<float>(scene, i, {}, d);
      if (h.b0 > 0 && h.b1 > 0 && h.b2 > 0) prim = i;
    }
    return texture_point(scene, surface_at<float>(scene, prim, {}, d), 0);
  }
  TemporaryFolder folder_;
  TestScene s_;
};

TEST_F(SecondUvs, AsColours) {
  reflect(1);
  const RenderScene scene = build_scene(s_.scene);
  EXPECT_TRUE(scene.any_second_uvs);
  for (const float x : {-0.8f, -0.3f, 0.4f, 0.9f}) {
    const TexturePoint at = point(scene, x);
    EXPECT_NEAR(at.u, (x + 1) / 2, 1e-5f);
    EXPECT_NEAR(at.second_u, 0.5f + (x + 1) / 4, 1e-5f);
    EXPECT_EQ(scene.textures.evaluate(1, at).r, 0.75f) << x;
  }
}

TEST_F(SecondUvs, AndVertexColoursInGraphs) {
  auto mesh = std::make_shared<TriangleMesh>(*std::get<MeshShape>(shape().kind).mesh);
  for (const Vec3f& p : mesh->positions) mesh->colors.push_back({(p.x + 1) / 2, 0, 0, 1});
  shape().kind = MeshShape{mesh};
  GraphBuilder g;
  TextureDescription t;
  t.kind = GraphTexture{std::make_shared<const TextureGraph>(g.finish(
                            {g.input(GraphInput::kSecondU), g.input(GraphInput::kRed), g.constant(0)})),
                        {}};
  s_.scene.textures.push_back(t);
  reflect(2);
  const RenderScene scene = build_scene(s_.scene);
  const Rgb c = scene.textures.evaluate(2, point(scene, 0.4f));
  EXPECT_NEAR(c.r, 0.5f + 1.4f / 4, 1e-5f);
  EXPECT_NEAR(c.g, 0.7f, 1e-5f);
}

TEST_F(SecondUvs, AreNotKeptWhereNothingReadsThem) {
  reflect(0);
  const RenderScene scene = build_scene(s_.scene);
  EXPECT_FALSE(scene.any_second_uvs);
  EXPECT_TRUE(scene.second_uvs.empty());
  EXPECT_EQ(scene.textures.evaluate(0, point(scene, -0.5f)).r, 0);
}

TEST_F(SecondUvs, OnEmitters) {
  AreaLightDescription light;
  light.radiance = {1, 1, 1};
  light.texture = 1;
  light.two_sided = true;
  shape().area_light = 0;
  s_.scene.area_lights.push_back(light);
  const RenderScene scene = build_scene(s_.scene);
  ASSERT_EQ(scene.lights.count(), 2);
  for (const EmitterPattern& pattern : scene.lights.patterns) {
    const Vec3<float> c = pattern_at_sample(scene, pattern, false, 0.2f, 0.3f, {0, 0, -1}, {0, 0, 2});
    EXPECT_EQ(c.x, 0.75f);
  }
}

TEST_F(SecondUvs, AsAlpha) {
  for (const int texture : {0, 1}) {
    shape().alpha = {1, texture};
    const RenderScene scene = build_scene(s_.scene);
    int stopped = 0;
    for (int i = 0; i < 400; ++i) {
      const Vec3<float> d = normalize(Vec3<float>{-0.9f + 0.002f * static_cast<float>(i), -0.95f, 2});
      stopped += alpha_stops(alpha_at(scene, shape().alpha, 0, -1, 0, {}, d), 0, -1, {}, d);
    }
    // All of these lie in the dark half of the first set.
    EXPECT_EQ(stopped > 0, texture == 1) << stopped;
  }
}

}  // namespace
}  // namespace lightmill::test
