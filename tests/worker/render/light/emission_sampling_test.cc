// Emission sampling: power, densities in both directions of use, equal bits in lanes.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/worker/render/light/light_cases.h"

namespace lightmill::test {
namespace {

constexpr size_t kDirectionBins = 16;

EmissionSample<float> emit(const LightTable& lights, Random& random, float pick) {
  const float pu = random.uniform(), pv = random.uniform(), du = random.uniform(), dv = random.uniform();
  return sample_emission<float>(lights, pick, 0, pu, pv, du, dv);
}

size_t direction_bin(double x) {
  return std::min(static_cast<size_t>(std::max(x, 0.0) * kDirectionBins), kDirectionBins - 1);
}

// Radiance x cos / pdf is the light's whole power on every path: pi A L, twice for both sides,
// 4 pi I for a point.
TEST(EmissionSampling, EveryPathCarriesThePower) {
  Random random(1);
  {
    const LightScene scene(triangle_light());
    const LightRecord<float> r(scene.lights(), 0);
    for (int i = 0; i < 1000; ++i) {
      const auto e = emit(scene.lights(), random, 0);
      ASSERT_NEAR(e.power.x / (M_PI * r.scalar(kLightArea) * 2), 1, 1e-5);
      ASSERT_NEAR(e.power.z / e.power.x, 0.25, 1e-6);
    }
  }
  {
    const LightScene scene(triangle_light(true));
    const LightRecord<float> r(scene.lights(), 0);
    for (int i = 0; i < 1000; ++i)
      ASSERT_NEAR(emit(scene.lights(), random, 0).power.x / (2 * M_PI * r.scalar(kLightArea) * 2), 1, 1e-5);
  }
  {
    TestScene s;
    s.point_light({0, 0, 1}, {1, 1, 1});
    const LightScene scene(s);
    for (int i = 0; i < 1000; ++i)
      ASSERT_NEAR(emit(scene.lights(), random, 0).power.x / (4 * M_PI * scene.scale * scene.scale), 1, 1e-5);
  }
  {
    TestScene s;
    s.sphere({0, 0, 3}, 1, s.diffuse(0.5f)).environment({1, 1, 1});
    const LightScene scene(s);
    const double r = scene.scene.bounds_radius;
    for (int i = 0; i < 1000; ++i) {
      const auto e = emit(scene.lights(), random, 0);
      ASSERT_TRUE(e.infinite);
      ASSERT_NEAR(e.power.x / (4 * M_PI * M_PI * r * r), 1, 1e-5);
      // It starts outside of the scene's sphere and its line passes through it.
      const Vec3<float> c = e.point - Vec3<float>{scene.scene.bounds_center[0], scene.scene.bounds_center[1],
                                                  scene.scene.bounds_center[2]};
      const double along = dot(c, e.direction), off2 = double{dot(c, c)} - along * along;
      ASSERT_LE(along, -r * 0.9999);
      ASSERT_LE(off2, r * r * 1.0001);
    }
  }
}

// Directions are cosine-distributed about the normal, on both sides of a two-sided light.
TEST(EmissionSampling, DirectionsFollowTheCosine) {
  for (const bool two_sided : {false, true}) {
    const LightScene scene(triangle_light(two_sided));
    Random random(2);
    constexpr int kSamples = 100000;
    std::vector<double> observed(2 * kDirectionBins), expected(2 * kDirectionBins);
    for (size_t i = 0; i < kDirectionBins; ++i) {
      expected[i] = double{kSamples} / kDirectionBins / (two_sided ? 2 : 1);
      expected[kDirectionBins + i] = two_sided ? expected[i] : 0;
    }
    for (int i = 0; i < kSamples; ++i) {
      const auto e = emit(scene.lights(), random, 0);
      const double c = dot(e.direction, e.normal);
      ASSERT_NEAR(std::fabs(c), e.cos_light, 1e-5);
      ++observed[(c < 0 ? kDirectionBins : 0) + direction_bin(c * c)];
    }
    EXPECT_TRUE(chi_square_passes(chi_square(observed, expected), 2));
  }
}

// The density of emission at the point and direction that direct sampling found is what
// emission sampling reports.
TEST(EmissionSampling, DensityIsTheOneThatDirectSamplingReports) {
  const LightScene scene(mixed_lights());
  Random random(3);
  int compared = 0;
  for (int i = 0; i < 20000; ++i) {
    const float pick = random.uniform();
    const auto e = emit(scene.lights(), random, pick);
    ASSERT_EQ(e.light, select_light<float>(scene.lights(), pick));
    ASSERT_NEAR(e.pdf / emission_pdf<float>(scene.lights(), e.light, {}, {}, e.cos_light), 1, 1e-6);
    const Vec3<float> reference{static_cast<float>(random.between(-1, 1)), 0, 0};
    const auto d =
        sample_direct<float>(scene.lights(), reference, pick, 0, random.uniform(), random.uniform());
    if (!(d.radiance.x > 0)) continue;
    ASSERT_NEAR(d.pdf_emission / emission_pdf<float>(scene.lights(), e.light, {}, {}, d.cos_light), 1, 1e-5);
    ++compared;
  }
  EXPECT_GT(compared, 5000);
}

// int pdf_emission over directions at a point = density of the point alone = selection / area.
TEST(EmissionSampling, DensityIntegratesToThatOfThePoint) {
  for (const bool two_sided : {false, true}) {
    const LightScene scene(triangle_light(two_sided));
    const LightRecord<float> r(scene.lights(), 0);
    constexpr int kSteps = 2000;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
      const auto c = static_cast<float>((i + 0.5) / kSteps);
      sum += emission_pdf<float>(scene.lights(), 0, {}, {}, c) * 2 * M_PI / kSteps * (two_sided ? 2 : 1);
    }
    EXPECT_NEAR(sum * r.scalar(kLightArea), 1, 1e-4);
  }
}

TEST(EmissionSampling, LanesHaveTheBitsOfScalars) {
  const LightScene scene(mixed_lights());
  Random random(4);
  for (int round = 0; round < 3000; ++round) {
    Float8 x[5];
    for (Float8& f : x) {
      for (int l = 0; l < 8; ++l) f[l] = random.uniform();
    }
    const auto s = sample_emission<Float8>(scene.lights(), x[0], Float8{}, x[1], x[2], x[3], x[4]);
    for (int l = 0; l < 8; ++l) {
      const auto t = sample_emission<float>(scene.lights(), x[0][l], 0, x[1][l], x[2][l], x[3][l], x[4][l]);
      ASSERT_EQ(s.light[l], t.light);
      ASSERT_EQ(float_bits(s.point.x[l]), float_bits(t.point.x));
      ASSERT_EQ(float_bits(s.direction.y[l]), float_bits(t.direction.y));
      ASSERT_EQ(float_bits(s.power.x[l]), float_bits(t.power.x));
      ASSERT_EQ(float_bits(s.pdf[l]), float_bits(t.pdf));
      ASSERT_EQ(s.infinite[l] != 0, t.infinite);
    }
  }
}

}  // namespace
}  // namespace lightmill::test
