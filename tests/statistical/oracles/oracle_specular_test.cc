// Mirrors and glass of known transport, by the estimators that see through specular surfaces. alpha = 1e-4.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/render.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

constexpr int kSpecularBatches = 16;

class Specular : public ::testing::TestWithParam<Integrator> {
 protected:
  Batches render(const TestScene& s, int max_depth, int64_t spp) const {
    Batches b = render_batches(s.scene, settings_for(s.scene, GetParam(), spp, max_depth), kSpecularBatches);
    EXPECT_EQ(b.counters.nonfinite, 0u);
    return b;
  }
};

/// Fresnel reflectance of a dielectric at normal incidence.
double normal_fresnel(double n) { return (n - 1) * (n - 1) / ((n + 1) * (n + 1)); }

// Oracle 3: a smooth glass sphere in a constant environment is invisible.
TEST_P(Specular, GlassSphereInAConstantEnvironment) {
  for (const float eta : {1.0f, 1.3f, 1.5f, 2.4f}) {
    TestScene s;
    s.sphere({0, 0, 0}, 1, s.dielectric(eta, 0)).environment({2, 1, 0.5});
    s.camera({0, 0.5, -4}, {0, 0, 0}, 40).film(16, 16);
    const Batches b = render(s, kUnlimitedDepth, 256);
    EXPECT_TRUE(mean_is(b.mean(0), 2.0, {.resolution = 0.01})) << "eta " << eta;
    EXPECT_TRUE(mean_is(b.mean(2), 0.5, {.resolution = 0.01})) << "eta " << eta;
  }
}

// The same of a hollow ball, whose inner sphere has its orientation reversed.
TEST_P(Specular, HollowGlassBallInAConstantEnvironment) {
  TestScene s;
  const int glass = s.dielectric(1.5f, 0);
  s.sphere({0, 0, 0}, 1, glass).sphere({0, 0, 0}, 0.85, glass, {.inward = true}).environment({1, 1, 1});
  s.camera({0, 0.5, -4}, {0, 0, 0}, 30).film(16, 16);
  EXPECT_TRUE(mean_is(render(s, kUnlimitedDepth, 256).mean(), 1.0, {.resolution = 0.01}));
}

// Oracle 4: from inside glass the environment has radiance n^2 L0.
TEST_P(Specular, CameraInsideGlassSeesNSquared) {
  for (const float n : {1.33f, 1.5f}) {
    TestScene s;
    s.sphere({0, 0, 0}, 1, s.dielectric(n, 0)).environment({1, 1, 1});
    s.camera({0, 0, 0}, {0.3, 0.2, 1}, 50).film(16, 16);
    EXPECT_TRUE(mean_is(render(s, kUnlimitedDepth, 256).mean(), double{n} * n, {.resolution = 0.01}))
        << "n " << n;
  }
}

// Oracle 13: a mirror's image of an emitter, and two parallel emitting mirrors: sum of L r^k.
TEST_P(Specular, PlaneMirror) {
  constexpr float kR = 0.7f;
  TestScene s;
  s.quad({-1, -1, 2}, {0, 2, 0}, {2, 0, 0}, s.conductor(kR, 0));
  s.quad({-30, -30, -2}, {60, 0, 0}, {0, 60, 0}, s.diffuse(0), {.radiance = {3, 3, 3}});
  s.camera({0, 0, 0}, {0, 0, 1}, 4).film(8, 8);
  EXPECT_TRUE(mean_is(render(s, 5, 256).mean(), 3.0 * kR, {.resolution = 0.01, .rounding = 1e-3}));
}

TEST_P(Specular, ParallelMirrors) {
  constexpr float kR = 0.8f;
  for (const int max_depth : {0, 1, 4, 9}) {
    TestScene s;
    const int mirror = s.conductor(kR, 0);
    s.quad({-10, -10, 1}, {0, 20, 0}, {20, 0, 0}, mirror, {.radiance = {1, 1, 1}});
    s.quad({-10, -10, -1}, {20, 0, 0}, {0, 20, 0}, mirror, {.radiance = {1, 1, 1}});
    s.camera({0, 0, 0}, {0, 0, 1}, 4).film(8, 8);
    const double exact = (1 - std::pow(kR, max_depth + 1)) / (1 - kR);
    EXPECT_TRUE(mean_is(render(s, max_depth, 512).mean(), exact, {.resolution = 0.02, .rounding = 1e-3}))
        << "depth " << max_depth;
  }
}

// Oracle 14: a slab at normal incidence transmits (1 - F) / (1 + F) and reflects 2F / (1 + F).
TEST_P(Specular, DielectricSlab) {
  constexpr float kN = 1.5f;
  const double f = normal_fresnel(kN), transmitted = (1 - f) / (1 + f);
  TestScene s;
  s.box({-20, -20, 1}, {20, 20, 1.2}, s.dielectric(kN, 0));
  const int black = s.diffuse(0);
  s.quad({-60, -60, 3}, {0, 120, 0}, {120, 0, 0}, black, {.radiance = {5, 5, 5}});
  s.quad({-60, -60, -3}, {120, 0, 0}, {0, 120, 0}, black, {.radiance = {2, 2, 2}});
  s.camera({0, 0, 0}, {0, 0, 1}, 3).film(8, 8);
  EXPECT_TRUE(mean_is(render(s, kUnlimitedDepth, 1024).mean(), 5 * transmitted + 2 * (1 - transmitted),
                      {.resolution = 0.02, .rounding = 1e-3}));
}

// Light paths through refraction: the adjoint carries no 1 / eta^2. A point light inside a glass sphere's
// centre leaves it undeviated, so the irradiance outside is that without the sphere (no absorption; all that
// is reflected returns through the centre and leaves in the end).
TEST(SpecularLightPaths, PointLightInAGlassSphere) {
  TestScene s;
  constexpr float kRho = 0.6f, kRadius = 3;
  s.sphere({0, 0, 0}, 1, s.dielectric(1.5f, 0));
  s.sphere({0, 0, 0}, kRadius, s.diffuse(kRho), {.inward = true});
  s.point_light({0, 0, 0}, {2, 2, 2});
  s.camera({0, 2, 0}, {0.5, 3, 0.5}, 40).film(8, 8);
  const double exact = kRho / M_PI * 2 / (kRadius * kRadius);
  // Every bounce sees the whole sphere or refracts through the ball, which in turn sees the whole sphere: the
  // enclosure is lossless, so irradiances still form a geometric series.
  for (const Integrator i : {Integrator::kLt, Integrator::kBdpt}) {
    const Batches b =
        render_batches(s.scene, settings_for(s.scene, i, 8192, kUnlimitedDepth), kSpecularBatches);
    EXPECT_EQ(b.counters.nonfinite, 0u);
    EXPECT_TRUE(mean_is(b.mean(), exact / (1 - kRho), {.resolution = 0.1})) << name_of(i);
  }
}

INSTANTIATE_TEST_SUITE_P(All, Specular, ::testing::Values(Integrator::kPt, Integrator::kBdpt),
                         [](const auto& info) { return name_of(info.param); });

}  // namespace
}  // namespace lightmill::test
