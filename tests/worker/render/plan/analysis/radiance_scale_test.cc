// The scale of the exact sums, and the brightness that a scene's lights are brought to.
#include "worker/render/plan/analysis/radiance_scale.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/render.h"
#include "tests/support/test_scene.h"
#include "worker/render/scene/lights/normalised_light.h"

namespace lightmill::test {
namespace {

/// A floor under a ball of light, and room for more.
TestScene lit_floor(float radiance) {
  TestScene s;
  s.quad({-5, 0, -5}, {0, 0, 10}, {10, 0, 0}, s.diffuse(0.5f));
  s.sphere({0, 2, 0}, 0.5, s.diffuse(0), {.radiance = {radiance, radiance, radiance}});
  s.camera({0, 3, -6}, {0, 0, 0}, 20).film(16, 16);
  return s;
}

int quantum_of(const TestScene& s) {
  return Renderer(s.scene, settings_for(s.scene, Integrator::kBdpt, 16, 3), 1).quantum_exponent();
}

TEST(RadianceScale, GoesWithTheLight) {
  for (const int exponent : {-100, -30, 30, 100})
    EXPECT_EQ(quantum_of(lit_floor(std::ldexp(1.0f, exponent))), quantum_of(lit_floor(1)) + exponent)
        << exponent;
}

TEST(RadianceScale, HiddenLampsDoNotCount) {
  for (const float hidden : {1e-20f, 1e18f, 1e30f}) {
    TestScene s = lit_floor(1);
    s.sphere({0, -5, 0}, 1, s.diffuse(0)).point_light({0, -5, 0}, {hidden, hidden, hidden});
    // What is seen, about 0.1, has 24 bits and more, and a million times as much fits.
    const int quantum = quantum_of(s);
    EXPECT_LE(quantum, -3 - 24) << hidden;
    EXPECT_GE(quantum, 20 - kMaxContributionBits) << hidden;
  }
}

// Workers keep scenes for jobs of other depths: all have to sum by one quantum, whichever came first.
TEST(RadianceScale, IsThatOfTheSceneWhateverTheDepth) {
  TestScene s = lit_floor(1);
  s.sphere({0, -5, 0}, 1, s.diffuse(0)).point_light({0, -5, 0}, {1e18f, 1e18f, 1e18f});
  const RenderSettings shallow = settings_for(s.scene, Integrator::kBdpt, 16, 0),
                       deep = settings_for(s.scene, Integrator::kBdpt, 16, 5);
  const Renderer first(s.scene, shallow, 1);
  EXPECT_EQ(Renderer(first, deep).quantum_exponent(), Renderer(s.scene, deep, 1).quantum_exponent());
}

TEST(NormalisedLight, LeavesPlainScenesAlone) {
  for (const float radiance : {1e-11f, 1.0f, 1e11f}) {
    EXPECT_EQ(light_exponent(lit_floor(radiance).scene, 0), 0) << radiance;
  }
}

TEST(NormalisedLight, BringsOthersToTheMiddle) {
  EXPECT_EQ(light_exponent(lit_floor(0x1p100f).scene, 0), 100);
  TestScene two = lit_floor(0x1p-60f);
  two.point_light({0, 3, 0}, {0x1p20f, 0, 0});
  EXPECT_EQ(light_exponent(two.scene, 0), -20);
  TestScene far = lit_floor(0x1p-120f);
  far.point_light({0, 3, 0}, {0x1p120f, 0, 0});
  EXPECT_EQ(light_exponent(far.scene, 0), 70);
}

TEST(NormalisedLight, IntensitiesGoWithTheSize) {
  TestScene s;
  s.point_light({0, 3, 0}, {0x1p100f, 0, 0});
  EXPECT_EQ(light_exponent(s.scene, -50), 0);
  EXPECT_EQ(light_exponent(s.scene, 0), 100);
}

TEST(NormalisedLight, LeavesAFilmWithALimitAlone) {
  SceneDescription scene = lit_floor(0x1p100f).scene;
  scene.film.most = 5;
  EXPECT_EQ(light_exponent(scene, 0), 0);
}

}  // namespace
}  // namespace lightmill::test
