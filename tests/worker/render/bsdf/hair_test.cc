// Hair: energy over all directions, whatever the offset from the axis; the factors' formulas; and a mass of
// lossless fibres, which can't be told from a bright sky.
#include "worker/render/bsdf/hair.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/base/error.h"
#include "common/scene/mesh/curve_mesh.h"
#include "tests/support/agreement.h"
#include "tests/support/test_scene.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"

namespace lightmill::test {
namespace {

/// Mean weight of camera paths.
Estimate albedo(const BsdfCase& hair, const Vec3<float>& wo) {
  Random random(5);
  std::vector<double> batches(32);
  for (double& b : batches) {
    for (int i = 0; i < 2000; ++i) {
      const BsdfSample<float> s = hair.sample(wo, random);
      if (s.valid) b += s.weight.y / 2000;
    }
  }
  return estimate(batches);
}

TEST(Hair, WithoutAbsorptionNothingIsLost) {
  for (BsdfCase& hair : all_bsdfs()) {
    if (hair.kind != kHair) continue;
    for (const float h : {-0.95f, -0.5f, 0.0f, 0.3f, 0.8f}) {
      hair.params.p[8] = h;
      for (const double degrees : {5.0, 40.0, 75.0}) {
        const Estimate e = albedo(hair, direction_at(degrees));
        SCOPED_TRACE(hair.name + " h " + std::to_string(h) + " at " + std::to_string(degrees));
        if (hair.name == "hair_white") {
          EXPECT_TRUE(mean_is(e, 1, {.resolution = 0.005, .rounding = 1e-3}));
        } else {
          EXPECT_LT(e.mean, 1);
          EXPECT_GT(e.mean, 0.05);
        }
      }
    }
  }
}

/// I_0 by its integral over half a turn, in double.
double bessel_i0_scaled(double x) {
  constexpr int kSteps = 4000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) sum += std::exp(x * (std::cos(M_PI * (i + 0.5) / kSteps) - 1)) / kSteps;
  return sum;
}

TEST(Hair, BesselFunctionIsThatOfItsIntegral) {
  for (const double x : {0.0, 0.1, 1.0, 3.0, 3.74, 3.76, 6.0, 12.0, 100.0, 3000.0})
    EXPECT_NEAR(scaled_bessel_i0(static_cast<float>(x)) / bessel_i0_scaled(x), 1, 2e-6) << x;
}

// A sleek fibre that is met in the middle, across: light is reflected back and goes through straight on.
TEST(Hair, LobesLieWhereASmoothFibreSendsLight) {
  BsdfCase hair = all_bsdfs()[0];
  for (const BsdfCase& c : all_bsdfs()) {
    if (c.name == "hair_sleek") hair = c;
  }
  hair.params.p[5] = 0;  // no tilt
  hair.params.p[8] = 0;
  hair.params.p[9] = 0;
  const Vec3<float> wo{0, 0, 1};
  const auto at = [&](float y, float z) { return hair.eval(wo, {0, y, z}).f.y * std::fabs(z); };
  EXPECT_GT(at(0, 1), 3 * at(0.8f, 0.6f));
  EXPECT_GT(at(0, -1), 3 * at(0.8f, -0.6f));
  EXPECT_NEAR(at(0.6f, 0.8f) / at(-0.6f, 0.8f), 1, 1e-3);
  // Off the axis reflection turns by twice the angle of incidence, to the side of the offset.
  hair.params.p[8] = 0.5f;
  const float s = std::sqrt(0.75f);
  EXPECT_GT(at(s, 0.5f), 5 * at(-s, 0.5f));
}

/// Curves from a grid on the floor, bent at random.
void add_tuft(TestScene& s, int material, bool flat) {
  Random random(3);
  for (int i = 0; i < 60; ++i) {
    const double x = random.between(-0.6, 0.6), z = random.between(-0.6, 0.6);
    BezierChain chain;
    chain.points = {{x, -0.8, z}, {x, -0.3, z}};
    for (const double y : {0.3, 0.8}) chain.points.push_back({x + random.between(-0.4, 0.4), y, z});
    chain.width0 = chain.width1 = 0.1;
    auto mesh = std::make_shared<TriangleMesh>(curve_mesh(chain));
    mesh->flat = flat;
    ShapeDescription& shape = s.scene.shapes.emplace_back();
    shape.kind = MeshShape{mesh};
    shape.material = material;
  }
}

// In a uniform sky nothing lossless is seen; what a fibre lost by shading itself, or by sides that don't fit,
// would be dark. Ribbons of a lossless diffuse material stand for flat curves.
TEST(Hair, LosslessFibresVanishInAUniformSky) {
  for (const bool hair : {true, false}) {
    TestScene s;
    HairMaterial white;
    white.sigma_a.value = {0, 0, 0};
    const int material = hair ? static_cast<int>(s.scene.materials.size()) : s.diffuse(1.0f);
    if (hair) s.scene.materials.push_back({"", white, {}});
    add_tuft(s, material, true);
    s.environment({1, 1, 1}).camera({0, 0, -3}, {0, 0, 0}, 40).film(16, 16);
    const Batches b = render_batches(s.scene, settings_for(s.scene, Integrator::kPt, 256, 300), 16);
    EXPECT_EQ(b.counters.nonfinite, 0u);
    EXPECT_TRUE(mean_is(b.mean(1), 1, {.resolution = 0.01, .rounding = 2e-3})) << (hair ? "hair" : "diffuse");
  }
}

TEST(Hair, LightPathsAreLeftOutAndAloneRefused) {
  TestScene s;
  s.scene.materials.push_back({"", HairMaterial{}, {}});
  add_tuft(s, 0, true);
  s.quad({-1, 2, -1}, {2, 0, 0}, {0, 0, 2}, s.diffuse(0.5f), {.radiance = {3, 3, 3}, .two_sided = true});
  s.camera({0, 0, -3}, {0, 0, 0}, 40).film(16, 16);
  const auto pt = render_batches(s.scene, settings_for(s.scene, Integrator::kPt, 16, 4), 1);
  const auto bdpt = render_batches(s.scene, settings_for(s.scene, Integrator::kBdpt, 16, 4), 1);
  EXPECT_EQ(pt.images[0].data, bdpt.images[0].data);
  EXPECT_THROW(render_batches(s.scene, settings_for(s.scene, Integrator::kLt, 16, 4), 1), Error);
}

}  // namespace
}  // namespace lightmill::test
