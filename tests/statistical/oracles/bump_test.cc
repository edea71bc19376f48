// pt, bdpt and lt agree where normal maps tilt the shading normals, also away from the viewer: the adjoint
// correction holds for them too.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/agreement.h"
#include "tests/support/statistics.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

Batches bump_batches(const TestScene& s, Integrator integrator, int64_t spp) {
  Batches b = render_batches(s.scene, settings_for(s.scene, integrator, spp, 4), 16);
  EXPECT_EQ(b.counters.nonfinite, 0u);
  return b;
}

/// The room with a checkerboard of two tilts on all its white surfaces and a bumpy metal ball.
TestScene bumpy_room() {
  TestScene s = cornell_room();
  const Rgb left{0.3f, 0.55f, 0.95f}, right{0.65f, 0.4f, 0.9f};
  s.scene.textures.push_back({"tilts", true, CheckerboardTexture{{left, -1}, {right, -1}, {5, 5, 0, 0}}, {}});
  s.scene.materials[0].normal_map = 0;  // the room's white
  const int metal = s.conductor(0.8f, 0.4f);
  s.scene.materials.back().normal_map = 0;
  s.sphere({-0.5, -0.6, 0.4}, 0.35, metal);
  return s;
}

TEST(BumpAgreement, EstimatorsAgreeOnTiltedNormals) {
  const TestScene s = bumpy_room();
  const Batches pt = bump_batches(s, Integrator::kPt, 2048), bdpt = bump_batches(s, Integrator::kBdpt, 1024),
                lt = bump_batches(s, Integrator::kLt, 4096);
  EXPECT_TRUE(images_agree(pt, bdpt));
  EXPECT_TRUE(images_agree(lt, bdpt, {.max_excluded = 0.2}));
  EXPECT_FALSE(images_agree(lt, scaled(bdpt, 1.03f), {.max_excluded = 0.2}));
}

/// A floor of reflectance 0.8 under a sky of 1, 2, 3, whose normals all lean 40 degrees to +x, seen from -x
/// at 20 degrees above it: by the shading normal from behind.
TestScene leaning_floor(double lean) {
  TestScene s;
  const int floor = s.diffuse(0.8f);
  const auto coded = [](double x) { return static_cast<float>(0.5 + 0.5 * x); };
  const Rgb normal{coded(std::sin(lean)), 0.5f, coded(std::cos(lean))};
  s.scene.textures.push_back({"lean", true, ConstantTexture{normal}, {}});
  s.scene.materials[static_cast<size_t>(floor)].normal_map = 0;
  s.quad({-2, 0, 2}, {4, 0, 0}, {0, 0, -4}, floor);
  s.environment({1, 2, 3}).camera({-3 * std::cos(0.35), 3 * std::sin(0.35), 0}, {0, 0, 0}, 9).film(8, 8);
  return s;
}

// Oracle: the sky above both planes, weighted by the cosine to the leaning one: rho L (1 + cos lean) / 2.
TEST(BumpAgreement, NormalsThatLookAwayFromTheViewerLeaveNoBlackSpots) {
  const double lean = 40 * M_PI / 180;
  const TestScene s = leaning_floor(lean);
  const double exact = 0.8 * (1 + std::cos(lean)) / 2;
  for (const Integrator integrator : {Integrator::kPt, Integrator::kLt, Integrator::kBdpt}) {
    const bool lt = integrator == Integrator::kLt;  // few of its paths meet so small a view
    const Batches b = render_batches(s.scene, settings_for(s.scene, integrator, lt ? 1 << 19 : 1024, 1), 16);
    EXPECT_EQ(b.counters.nonfinite, 0u);
    for (int c = 0; c < 3; ++c) {
      const MeanTest test{.resolution = lt ? 0.02 : 0.01};
      EXPECT_TRUE(mean_is(b.mean(c), exact * (c + 1), test)) << integrator_name(integrator) << ' ' << c;
      EXPECT_FALSE(mean_is(b.mean(c), 1.05 * exact * (c + 1), test));
    }
  }
}

/// Rough glass, rough metal and a mirror with steep waves, low over the floor and seen from there.
TestScene steep_room() {
  TestScene s = cornell_room();
  const Rgb left{0.1f, 0.5f, 0.8f}, right{0.85f, 0.4f, 0.82f};
  s.scene.textures.push_back({"tilts", true, CheckerboardTexture{{left, -1}, {right, -1}, {7, 7, 0, 0}}, {}});
  s.scene.materials[0].normal_map = 0;  // the room's white
  const auto bumpy = [&](int material) {
    s.scene.materials[static_cast<size_t>(material)].normal_map = 0;
    return material;
  };
  s.sphere({-0.5, -0.6, 0.4}, 0.35, bumpy(s.conductor(0.8f, 0.4f)));
  s.sphere({0.5, -0.7, 0.1}, 0.3, bumpy(s.dielectric(1.5f, 0.5f)));
  s.quad({-0.9, -0.95, -0.2}, {0.8, 0, 0}, {0, 0, -0.5}, bumpy(s.conductor(0.9f, 0)));
  s.camera({0, -0.8, -0.95}, {0, -0.8, 1}, 80);
  return s;
}

TEST(BumpAgreement, EstimatorsAgreeOnSteepNormalsUnderFlatAngles) {
  const TestScene s = steep_room();
  const Batches pt = bump_batches(s, Integrator::kPt, 4096), bdpt = bump_batches(s, Integrator::kBdpt, 2048);
  EXPECT_TRUE(images_agree(pt, bdpt));
  EXPECT_FALSE(images_agree(pt, scaled(bdpt, 1.03f)));
}

/// Without the mirror, of whose light lt sees nothing, lt sees all.
TEST(BumpAgreement, LightPathsFindBothSidesOfSteepNormals) {
  TestScene s = steep_room();
  s.scene.materials.back() = s.scene.materials[0];
  const Batches pt = bump_batches(s, Integrator::kPt, 4096), lt = bump_batches(s, Integrator::kLt, 8192);
  EXPECT_TRUE(images_agree(lt, pt, {.max_excluded = 0.2}));
  EXPECT_FALSE(images_agree(lt, scaled(pt, 1.03f), {.max_excluded = 0.2}));
}

// Without the map the picture is another one: the test above sees the tilts.
TEST(BumpAgreement, TiltsChangeThePicture) {
  const TestScene bumpy = bumpy_room();
  TestScene flat = bumpy;
  for (MaterialDescription& m : flat.scene.materials) m.normal_map = -1;
  EXPECT_FALSE(
      images_agree(bump_batches(bumpy, Integrator::kPt, 1024), bump_batches(flat, Integrator::kPt, 1024)));
}

}  // namespace
}  // namespace lightmill::test
