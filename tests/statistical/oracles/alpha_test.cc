// Alpha masks: what passes is 1 - alpha of every kind of ray, and the three estimators agree. alpha = 1e-4.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/agreement.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

constexpr int kBatches = 16;

Batches render(const TestScene& s, Integrator integrator, int max_depth, int64_t spp) {
  Batches b = render_batches(s.scene, settings_for(s.scene, integrator, spp, max_depth), kBatches);
  EXPECT_EQ(b.counters.nonfinite, 0u);
  return b;
}

/// A float checkerboard of 0 and 1 with `cells` to the unit of u and v.
int checkerboard(TestScene* s, float cells) {
  TextureDescription t;
  t.is_spectrum = false;
  t.kind = CheckerboardTexture{{{1, 1, 1}, -1}, {{0, 0, 0}, -1}, {cells, cells, 0, 0}};
  s->scene.textures.push_back(t);
  return static_cast<int>(s->scene.textures.size()) - 1;
}

class Alpha : public ::testing::TestWithParam<Integrator> {};

// A black screen of alpha 0.3 before an emitter: 0.7 Le of it is seen.
TEST_P(Alpha, ConstantScreenTransmitsTheRest) {
  TestScene s;
  s.quad({-2, -2, 4}, {0, 4, 0}, {4, 0, 0}, s.diffuse(0.0f), {.radiance = {2, 2, 2}});
  s.quad({-9, -9, 2}, {0, 18, 0}, {18, 0, 0}, s.diffuse(0.0f)).scene.shapes.back().alpha.value = 0.3f;
  s.camera({0, 0, 0}, {0, 0, 1}, 40).film(8, 8);
  const int64_t spp = GetParam() == Integrator::kLt ? 32768 : 1024;
  EXPECT_TRUE(mean_is(render(s, GetParam(), 2, spp).mean(), 2 * 0.7, {.resolution = 0.02}));
}

// Shadow rays: the same screen between a lamp and the floor takes 0.3 of the floor's light.
TEST_P(Alpha, ScreenBeforeALampDimsTheFloor) {
  const auto floor_light = [&](float alpha) {
    TestScene s;
    s.quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, s.diffuse(0.5f)).point_light({0, 3, 0}, {5, 5, 5});
    if (alpha > 0) {
      s.quad({-9, 2.5, -9}, {0, 0, 18}, {18, 0, 0}, s.diffuse(0.0f)).scene.shapes.back().alpha.value = alpha;
    }
    s.camera({0, 2, 0}, {0, 0, 0.01}, 60).film(8, 8);
    return render(s, GetParam(), 1, GetParam() == Integrator::kLt ? 65536 : 4096).mean();
  };
  const Estimate open = floor_light(0), dimmed = floor_light(0.3f);
  EXPECT_TRUE(mean_is(dimmed, 0.7 * open.mean, {.resolution = 0.02, .rounding = 2e-3}));
}

// Two screens in a row multiply: decisions about one ray at two primitives are independent.
TEST_P(Alpha, ScreensInARowMultiply) {
  TestScene s;
  s.quad({-2, -2, 4}, {0, 4, 0}, {4, 0, 0}, s.diffuse(0.0f), {.radiance = {1, 1, 1}});
  for (const double z : {1.0, 1.5, 2.0}) {
    s.quad({-9, -9, z}, {0, 18, 0}, {18, 0, 0}, s.diffuse(0.0f)).scene.shapes.back().alpha.value = 0.5f;
  }
  s.camera({0, 0, 0}, {0, 0, 1}, 40).film(8, 8);
  const int64_t spp = GetParam() == Integrator::kLt ? 65536 : 8192;
  EXPECT_TRUE(mean_is(render(s, GetParam(), 2, spp).mean(), 0.125,
                      {.resolution = GetParam() == Integrator::kLt ? 0.05 : 0.03}));
}

// More screens than are decided by one number of the path (PassedSurfaces::kMost); every other one is in an
// instance.
TEST_P(Alpha, ManyScreensInARowMultiply) {
  constexpr int kScreens = 9;
  TestScene s;
  s.quad({-2, -2, 4}, {0, 4, 0}, {4, 0, 0}, s.diffuse(0.0f), {.radiance = {1, 1, 1}});
  const int black = s.diffuse(0.0f);
  for (int i = 0; i < kScreens; ++i) {
    s.quad({-9, -9, 1 + 0.2 * i}, {0, 18, 0}, {18, 0, 0}, black).scene.shapes.back().alpha.value = 0.2f;
    if (i % 2 == 0) continue;
    s.scene.objects.push_back({});
    s.scene.objects.back().shapes.push_back(s.scene.shapes.back());
    s.scene.shapes.pop_back();
    s.scene.instances.push_back({static_cast<int>(s.scene.objects.size()) - 1});
  }
  s.camera({0, 0, 0}, {0, 0, 1}, 40).film(8, 8);
  const int64_t spp = GetParam() == Integrator::kLt ? 65536 : 4096;
  EXPECT_TRUE(mean_is(render(s, GetParam(), 2, spp).mean(), std::pow(0.8, kScreens), {.resolution = 0.05}));
}

INSTANTIATE_TEST_SUITE_P(Integrators, Alpha,
                         ::testing::Values(Integrator::kPt, Integrator::kBdpt, Integrator::kLt),
                         [](const auto& info) { return name_of(info.param); });

/// A room with a checkerboard cut-out below its lamp and a block of alpha 0.5.
TestScene masked_room() {
  TestScene s = cornell_room();
  const int grey = s.diffuse(0.6f);
  const int board = checkerboard(&s, 3);
  s.quad({-0.6, 0.6, -0.3}, {1.2, 0, 0}, {0, 0, 1.2}, grey);
  TriangleMesh mesh = *std::get<MeshShape>(s.scene.shapes.back().kind).mesh;
  mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  s.scene.shapes.back().kind = MeshShape{std::make_shared<TriangleMesh>(mesh)};
  s.scene.shapes.back().alpha.texture = board;
  const size_t first = s.scene.shapes.size();
  s.box({-0.7, -1, 0.2}, {-0.2, -0.3, 0.7}, grey);
  for (size_t i = first; i < s.scene.shapes.size(); ++i) s.scene.shapes[i].alpha.value = 0.5f;
  return s;
}

TEST(AlphaAgreement, EstimatorsAgreeOnACutOutAndAVeil) {
  const TestScene s = masked_room();
  const Batches pt = render(s, Integrator::kPt, 4, 2048), bdpt = render(s, Integrator::kBdpt, 4, 1024),
                lt = render(s, Integrator::kLt, 4, 4096);
  EXPECT_TRUE(images_agree(pt, bdpt));
  EXPECT_TRUE(images_agree(lt, bdpt, {.max_excluded = 0.2}));
  EXPECT_FALSE(images_agree(pt, scaled(bdpt, 1.03f)));
}

// Of a pixel's samples each part of a surface has its share: what passes, and of what is stopped the part of
// a mix that is met. If each choice were made by itself, the variance would be 7 times this bound.
TEST(AlphaAgreement, ChoicesAreStratified) {
  TestScene s;
  constexpr int64_t kSpp = 64;
  constexpr double kStops = 0.4, kMirror = 0.25, kSeen = 1 - kStops * (1 - kMirror);
  s.quad({-9, -9, 4}, {0, 18, 0}, {18, 0, 0}, s.diffuse(0.0f), {.radiance = {1, 1, 1}});
  s.quad({-9, -9, -4}, {18, 0, 0}, {0, 18, 0}, s.diffuse(0.0f), {.radiance = {1, 1, 1}});
  s.quad({-9, -9, 2}, {0, 18, 0}, {18, 0, 0}, s.mix(s.diffuse(0.0f), s.conductor(1, 0), kMirror))
      .scene.shapes.back()
      .alpha.value = kStops;
  s.camera({0, 0, 0}, {0, 0, 1}, 40).film(16, 16);
  double squares = 0;
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    const Image image =
        render_batches(s.scene, settings_for(s.scene, Integrator::kPt, kSpp, 1, seed), 1).images[0];
    for (size_t i = 0; i < image.data.size(); i += 3) squares += std::pow(double{image.data[i]} - kSeen, 2);
  }
  EXPECT_LT(squares / (8 * 256), kSeen * (1 - kSeen) / kSpp / 7);
}

// A board of 0 and 1 is exact: no ray is left to chance, so two seeds see the same pixels lit and dark.
TEST(AlphaAgreement, CheckerboardIsACutOut) {
  TestScene s;
  const int board = checkerboard(&s, 4);
  s.quad({-30, -30, 4}, {0, 60, 0}, {60, 0, 0}, s.diffuse(0.0f), {.radiance = {1, 1, 1}});
  s.quad({-1, -1, 2}, {2, 0, 0}, {0, 2, 0}, s.diffuse(0.0f));
  TriangleMesh mesh = *std::get<MeshShape>(s.scene.shapes.back().kind).mesh;
  mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  s.scene.shapes.back().kind = MeshShape{std::make_shared<TriangleMesh>(mesh)};
  s.scene.shapes.back().alpha.texture = board;
  s.camera({0, 0, 0}, {0, 0, 1}, 53.130102354).film(8, 8);  // the board fills the picture: 2 pixels a cell
  const Image image = render_batches(s.scene, settings_for(s.scene, Integrator::kPt, 256, 0), 16).images[0];
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) {
      const bool stops = (x / 2 + (7 - y) / 2) % 2 == 0;
      EXPECT_EQ(image.data[static_cast<size_t>(3 * (8 * y + x))], stops ? 0.0f : 1.0f) << x << ' ' << y;
    }
  }
}

}  // namespace
}  // namespace lightmill::test
