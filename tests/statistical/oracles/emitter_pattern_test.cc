// Emitters that do not shine evenly (textures, alpha, alpha 0) and lights that shine by an image: oracles,
// and the agreement of the three estimators. alpha = 1e-4 per comparison.
#include <gtest/gtest.h>

#include <cmath>

#include "common/base/error.h"
#include "common/image/image.h"
#include "tests/statistical/oracles/form_factor.h"
#include "tests/support/agreement.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_scene.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill::test {
namespace {

constexpr int kPatternBatches = 16;
constexpr double kRho = 0.5;

Batches render_pattern(const TestScene& s, Integrator integrator, int max_depth, int64_t spp) {
  Batches b = render_batches(s.scene, settings_for(s.scene, integrator, spp, max_depth), kPatternBatches);
  EXPECT_EQ(b.counters.nonfinite, 0u);
  return b;
}

void set_uvs(ShapeDescription& shape, const std::vector<Vec2f>& uvs) {
  TriangleMesh mesh = *std::get<MeshShape>(shape.kind).mesh;
  mesh.uvs = uvs;
  shape.kind = MeshShape{std::make_shared<TriangleMesh>(std::move(mesh))};
}
const std::vector<Vec2f> kSquare{{0, 0}, {1, 0}, {1, 1}, {0, 1}};

/// A texture that is `a` and `b` in the squares of a board, or as a float texture.
int board(TestScene* s, const Rgb& a, const Rgb& b, float cells, bool spectrum = true) {
  TextureDescription t;
  t.is_spectrum = spectrum;
  t.kind = CheckerboardTexture{{a, -1}, {b, -1}, {cells, cells, 0, 0}};
  s->scene.textures.push_back(t);
  return static_cast<int>(s->scene.textures.size()) - 1;
}
int image_texture(TestScene* s, const std::string& path) {
  ImageTexture image;
  image.path = path;
  image.wrap = Wrap::kClamp;
  s->scene.textures.push_back({"", true, image, {}});
  return static_cast<int>(s->scene.textures.size()) - 1;
}

/// A floor and, over it, what the caller hangs there.
TestScene floor_scene() {
  TestScene s;
  s.quad({-3, 0, -3}, {0, 0, 6}, {6, 0, 0}, s.diffuse(static_cast<float>(kRho)));
  s.camera({0.5, 2, -1.6}, {0, 0.3, 0}, 50).film(16, 16);
  return s;
}

class Pattern : public ::testing::TestWithParam<Integrator> {
 protected:
  int64_t spp(int64_t n) const { return GetParam() == Integrator::kLt ? 8 * n : n; }
  AgreementTest test() const { return {.max_relative_error = 0.1, .max_excluded = 0.25}; }
};

// The two halves of a picture are two plain emitters of their own colours.
TEST_P(Pattern, TwoTonesAreTwoEmitters) {
  const Rgb left{6, 2, 1}, right{1, 3, 8};
  TestScene textured = floor_scene(), plain = floor_scene();
  const Vec3d p{-0.8, 1, -0.4}, u{1.6, 0, 0}, v{0, 0.2, 0.9};
  textured.quad(p, u, v, textured.diffuse(0.3f), {.radiance = {2, 2, 2}});
  textured.scene.area_lights[0].texture =
      board(&textured, {left.r / 2, left.g / 2, left.b / 2}, {right.r / 2, right.g / 2, right.b / 2}, 2);
  // v within one row of the board's two columns.
  set_uvs(textured.scene.shapes.back(), {{0, 0.1f}, {1, 0.1f}, {1, 0.4f}, {0, 0.4f}});
  const int grey = plain.diffuse(0.3f);
  plain.quad(p, u * 0.5, v, grey, {.radiance = left})
      .quad(p + u * 0.5, u * 0.5, v, grey, {.radiance = right});
  const Batches a = render_pattern(textured, GetParam(), 3, spp(512)),
                b = render_pattern(plain, Integrator::kBdpt, 3, 512);
  EXPECT_TRUE(images_agree(a, b, test()));
  EXPECT_FALSE(images_agree(a, scaled(b, 1.06f), test()));
}

// A cut-out emitter is the squares that are left of it.
TEST_P(Pattern, CutOutsAreWhatIsLeft) {
  TestScene cut = floor_scene(), squares = floor_scene();
  const Vec3d p{-0.6, 0.9, -0.4}, u{1.2, 0, 0}, v{0, 0.1, 1.2};
  cut.quad(p, u, v, cut.diffuse(0.3f), {.radiance = {5, 4, 3}, .two_sided = true});
  set_uvs(cut.scene.shapes.back(), kSquare);
  cut.scene.shapes.back().alpha.texture = board(&cut, {1, 1, 1}, {0, 0, 0}, 2, false);
  const int grey = squares.diffuse(0.3f);
  const Emits emits{.radiance = {5, 4, 3}, .two_sided = true};
  squares.quad(p, u * 0.5, v * 0.5, grey, emits).quad(p + u * 0.5 + v * 0.5, u * 0.5, v * 0.5, grey, emits);
  const Batches a = render_pattern(cut, GetParam(), 3, spp(512)),
                b = render_pattern(squares, Integrator::kBdpt, 3, 512);
  EXPECT_TRUE(images_agree(a, b, test()));
  EXPECT_FALSE(images_agree(a, scaled(b, 1.06f), test()));
}

// An emitter of alpha 0.4 shines and is seen with 0.4 of its radiance, and reflects and hides 0.4.
TEST_P(Pattern, HalfAnEmitterShinesByHalf) {
  TestScene half = floor_scene(), dim = floor_scene();
  const Vec3d p{-0.6, 0.9, -0.4}, u{1.2, 0, 0}, v{0, 0.1, 1.2};
  half.quad(p, u, v, half.diffuse(0.3f), {.radiance = {5, 5, 5}, .two_sided = true});
  half.scene.shapes.back().alpha.value = 0.4f;
  dim.quad(p, u, v, dim.diffuse(0.3f), {.radiance = {2, 2, 2}, .two_sided = true});
  dim.scene.shapes.back().alpha.value = 1;
  // The same with an opaque emitter of the product, as far as nothing passes or is reflected: one event.
  const Batches a = render_pattern(half, GetParam(), 1, spp(512)),
                b = render_pattern(dim, Integrator::kBdpt, 1, 512);
  const AgreementTest upper{
      .max_relative_error = 0.1, .max_excluded = 0.25, .include = [](const PixelRect& r) {
        return r.y0 >= 8;  // the floor below the lamp alone
      }};
  EXPECT_TRUE(images_agree(a, b, upper));
  EXPECT_FALSE(images_agree(a, scaled(b, 1.06f), upper));
}

// Alpha 0: the same light without the lamp.
TEST_P(Pattern, UnseenEmittersShine) {
  for (const bool sphere : {false, true}) {
    TestScene unseen = floor_scene(), seen = floor_scene();
    for (TestScene* s : {&unseen, &seen}) {
      // Over the camera, so that it is not in the picture; black, so that it is not in the light.
      const Emits emits{.radiance = {6, 5, 4}};
      if (sphere) {
        s->sphere({0, 2.6, 0.5}, 0.4, s->diffuse(0.0f), emits);
      } else {
        s->quad({-0.5, 2.6, 0.1}, {1, 0, 0}, {0, 0.1, 1}, s->diffuse(0.0f), emits);
      }
      s->camera({0.5, 1.5, -1.6}, {0, 0, 0}, 40);
    }
    unseen.scene.shapes.back().alpha.value = 0;
    const Batches a = render_pattern(unseen, GetParam(), 2, spp(512)),
                  b = render_pattern(seen, Integrator::kBdpt, 2, 512);
    EXPECT_TRUE(images_agree(a, b, test())) << sphere;
    EXPECT_FALSE(images_agree(a, scaled(b, 1.06f), test())) << sphere;
    // Looking at it: black. (The light tracer alone finds the floor behind the camera, which is not seen.)
    unseen.camera({0, 1, 0}, {0, 2.6, 0.5}, 20).film(4, 4);
    EXPECT_EQ(render_pattern(unseen, GetParam(), 1, 256).mean().mean, 0) << sphere;
  }
}

// Oracle 7 with an image of one value, through a turned light, and half of it cut off by the horizon of a
// second value.
TEST_P(Pattern, PlaneUnderAGoniometricLight) {
  const TemporaryFolder folder;
  Image image(2, 2);
  for (float& x : image.data) x = 0.5f;
  write_image(image, folder.file("even.exr"));
  TestScene s;
  s.quad({-10, 0, -10}, {0, 0, 20}, {20, 0, 0}, s.diffuse(static_cast<float>(kRho)));
  s.camera({0.5, 2, -1}, {0, 0, 0}, 30).film(16, 16);
  Transform at;
  at.m = {{{0.8, 0, 0.6, 0.3}, {0, 1, 0, 1.5}, {-0.6, 0, 0.8, 0.2}, {0, 0, 0, 1}}};
  s.scene.lights.push_back({GoniometricLight{{8, 8, 8}, folder.file("even.exr"), at, 0}, {}});
  const auto radiance = [](const Vec3d& p) {
    const double d2 = (p.x - 0.3) * (p.x - 0.3) + (p.z - 0.2) * (p.z - 0.2) + 1.5 * 1.5;
    return kRho * 4 * 1.5 / (M_PI * std::pow(d2, 1.5));
  };
  const double resolution = GetParam() == Integrator::kLt ? 0.08 : 0.02;
  EXPECT_TRUE(mean_is(render_pattern(s, GetParam(), 1, 2048).mean(), mean_over_plane(s.scene, 0, radiance),
                      {.resolution = resolution}));
}

// The window of a projection light on the plane below it: point light inside, dark outside.
TEST_P(Pattern, PlaneUnderAProjection) {
  const TemporaryFolder folder;
  Image image(6, 3);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 6; ++x)
      image.pixel(x, y)[0] = image.pixel(x, y)[1] = image.pixel(x, y)[2] = x < 3 ? 4.0f : 1.0f;
  }
  write_image(image, folder.file("picture.exr"));
  TestScene s;
  s.quad({-10, 0, -10}, {0, 0, 20}, {20, 0, 0}, s.diffuse(static_cast<float>(kRho)));
  s.camera({0.5, 2, -1}, {0, 0, 0}, 30).film(16, 16);
  Transform down;  // +z to -y, +y to +z, +x stays
  down.m = {{{1, 0, 0, 0.1}, {0, 0, -1, 1.5}, {0, 1, 0, 0.05}, {0, 0, 0, 1}}};
  s.scene.lights.push_back({ProjectionLight{{1, 1, 1}, folder.file("picture.exr"), down, 20, 0}, {}});
  const double half = 1.5 * std::tan(10 * M_PI / 180);
  const auto radiance = [&](const Vec3d& p) {
    const double x = p.x - 0.1, z = p.z - 0.05, d2 = x * x + z * z + 1.5 * 1.5;
    if (std::fabs(x) > 2 * half || std::fabs(z) > half) return 0.0;
    return kRho * (x < 0 ? 4 : 1) * 1.5 / (M_PI * std::pow(d2, 1.5));
  };
  // The quadrature of a window's edge is known to a few per mille.
  EXPECT_TRUE(mean_is(render_pattern(s, GetParam(), 1, 2048).mean(), mean_over_plane(s.scene, 0, radiance),
                      {.resolution = 0.03, .rounding = 5e-3}));
}

INSTANTIATE_TEST_SUITE_P(Integrators, Pattern,
                         ::testing::Values(Integrator::kPt, Integrator::kBdpt, Integrator::kLt),
                         [](const auto& info) { return name_of(info.param); });

/// A picture with bright and black parts.
Image picture(int n) {
  Image image(n, n);
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      float* p = image.pixel(x, y);
      const bool dark = (x / 2 + y / 3) % 3 == 0;
      p[0] = dark ? 0 : 1 + 3.0f * static_cast<float>(x) / static_cast<float>(n);
      p[1] = dark ? 0.1f : 2.0f * static_cast<float>(y) / static_cast<float>(n);
      p[2] = dark ? 0 : 0.7f;
    }
  }
  return image;
}

// All of them at once in a room: an image on the lamp, on a sphere, a cut-out and an unseen lamp, a
// goniometric and a projection light.
TEST(PatternAgreement, Estimators) {
  const TemporaryFolder folder;
  write_image(picture(16), folder.file("picture.exr"));
  TestScene s = cornell_room();
  const int texture = image_texture(&s, folder.file("picture.exr"));
  for (ShapeDescription& shape : s.scene.shapes) {
    if (shape.area_light < 0) continue;
    set_uvs(shape, kSquare);
    s.scene.area_lights[static_cast<size_t>(shape.area_light)].texture = texture;
  }
  s.sphere({-0.6, -0.2, 0.5}, 0.2, s.diffuse(0.4f), {.radiance = {1, 1, 1}});
  s.scene.area_lights.back().texture = texture;
  s.quad({0.3, 0.2, 0.4}, {0.5, 0, 0}, {0, 0.5, 0.1}, s.diffuse(0.5f),
         {.radiance = {0.5f, 1, 1}, .two_sided = true});
  set_uvs(s.scene.shapes.back(), kSquare);
  s.scene.shapes.back().alpha.texture = board(&s, {1, 1, 1}, {0.2f, 0.2f, 0.2f}, 4, false);
  s.quad({-0.9, 0.6, -0.2}, {0.3, 0, 0}, {0, 0, 0.3}, s.diffuse(0.5f), {.radiance = {3, 1, 5}});
  s.scene.shapes.back().alpha.value = 0;
  Transform at;
  at.m = {{{1, 0, 0, 0.5}, {0, 1, 0, -0.1}, {0, 0, 1, -0.2}, {0, 0, 0, 1}}};
  s.scene.lights.push_back({GoniometricLight{{0.1f, 0.1f, 0.05f}, folder.file("picture.exr"), at, 0}, {}});
  at.m = {{{1, 0, 0, -0.3}, {0, 1, 0, 0.2}, {0, 0, 1, -0.6}, {0, 0, 0, 1}}};
  s.scene.lights.push_back({ProjectionLight{{0.2f, 0.2f, 0.3f}, folder.file("picture.exr"), at, 40, 0}, {}});
  const Batches pt = render_pattern(s, Integrator::kPt, 4, 1024),
                bdpt = render_pattern(s, Integrator::kBdpt, 4, 512),
                lt = render_pattern(s, Integrator::kLt, 4, 2048);
  EXPECT_TRUE(images_agree(pt, bdpt));
  EXPECT_TRUE(images_agree(lt, bdpt, {.max_excluded = 0.2}));
  EXPECT_FALSE(images_agree(pt, scaled(bdpt, 1.04f)));
}

// An image that cannot shine is refused, with the light's line.
TEST(PatternInput, RefusesImagesThatAreNoRadiance) {
  const TemporaryFolder folder;
  const std::pair<float, const char*> bad[] = {
      {NAN, "not a number"}, {INFINITY, "infinite"}, {-1.0f, "negative"}};
  for (const auto& [value, word] : bad) {
    Image image(4, 4);
    for (float& x : image.data) x = 1;
    image.data[3 * 6 + 1] = value;
    write_image(image, folder.file("lamp.exr"));
    TestScene s = floor_scene();
    s.quad({-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, s.diffuse(0), {.radiance = {1, 1, 1}});
    s.scene.area_lights[0].texture = image_texture(&s, folder.file("lamp.exr"));
    s.scene.area_lights[0].location = {"scene.pbrt", 12, 3};
    try {
      build_scene(s.scene);
      FAIL() << word;
    } catch (const Error& e) {
      const std::string message = e.what();
      EXPECT_EQ(message.rfind("scene.pbrt:12:3: ", 0), 0u) << message;
      EXPECT_NE(message.find(word), std::string::npos) << message;
    }
  }
}

// What shows only black of its image is no light; a texel beside it is as good as lit.
TEST(PatternInput, BlackPartsAreNoLights) {
  const TemporaryFolder folder;
  Image image(8, 8);
  write_image(image, folder.file("black.exr"));
  image.pixel(6, 1)[1] = 1;
  write_image(image, folder.file("dot.exr"));
  for (const bool black : {true, false}) {
    TestScene s = floor_scene();
    for (const float u : {0.0f, 0.5f}) {
      s.quad({u, 1, 0}, {0.4, 0, 0}, {0, 0, 1}, s.diffuse(0), {.radiance = {1, 1, 1}});
      set_uvs(s.scene.shapes.back(), {{u, 0.9f}, {u + 0.3f, 0.9f}, {u + 0.3f, 1}, {u, 1}});
    }
    const int texture = image_texture(&s, folder.file(black ? "black.exr" : "dot.exr"));
    for (AreaLightDescription& light : s.scene.area_lights) light.texture = texture;
    EXPECT_EQ(build_scene(s.scene).lights.count(), black ? 0 : 2);
  }
}

// The choice among lights follows what each part of a picture emits; "power" is of its mean luminance.
TEST(PatternInput, SelectionFollowsTheMeanAndPowerTheLuminance) {
  const TemporaryFolder folder;
  Image image(2, 1);
  image.data = {3, 3, 3, 1, 1, 1};
  write_image(image, folder.file("lamp.exr"));
  TestScene s = floor_scene();
  const Vec3d u{1, 0, 0}, v{0, 0, 1};
  s.quad({-1, 1, 0}, u, v, s.diffuse(0), {.radiance = {1, 1, 1}});
  const int texture = image_texture(&s, folder.file("lamp.exr"));
  s.quad({0, 1, 0}, u, v, s.diffuse(0)).scene.shapes.back().area_light = 0;
  s.scene.area_lights[0].texture = texture;
  s.scene.area_lights[0].of_mean_luminance = true;
  // Each quad sees one texel alone.
  set_uvs(s.scene.shapes[1], {{0.25f, 0.5f}, {0.25f, 0.5f}, {0.25f, 0.5f}, {0.25f, 0.5f}});
  set_uvs(s.scene.shapes[2], {{0.75f, 0.5f}, {0.75f, 0.5f}, {0.75f, 0.5f}, {0.75f, 0.5f}});
  const RenderScene scene = build_scene(s.scene);
  ASSERT_EQ(scene.lights.count(), 4);
  const auto probability = [&](size_t i) { return scene.lights.records[i * kLightFloats + kLightSelect]; };
  constexpr double kEven = 1.0 / 16;  // of the choice
  EXPECT_NEAR(probability(0), 0.375 * (1 - kEven) + 0.25 * kEven, 1e-6);
  EXPECT_NEAR(probability(3), 0.125 * (1 - kEven) + 0.25 * kEven, 1e-6);
  const double unit = std::ldexp(1.0, scene.scale_exponent);
  EXPECT_NEAR(scene.lights.total_power / (M_PI * 2 * unit * unit), 1, 1e-5);  // mean radiance 1 over area 2
}

}  // namespace
}  // namespace lightmill::test
