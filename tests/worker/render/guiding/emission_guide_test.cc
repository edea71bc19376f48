// Lights with an emission guide: light paths take directions by a table of cells, bring what they bring
// without one, and their densities are those of their directions; lanes have the bits of scalars.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/worker/render/light/light_cases.h"

namespace lightmill::test {
namespace {

constexpr int32_t kSide = 8;

/// Weights of all cells of a square, at random.
std::vector<double> random_weights(unsigned seed) {
  Random random(seed);
  std::vector<double> weights(size_t{kSide} * kSide);
  for (double& w : weights) w = 0.05 + double{random.uniform()} * random.uniform();
  return weights;
}

/// A lamp of two triangles with an emission guide, and one of one triangle without.
LightScene aimed_lamp() {
  TestScene s;
  s.quad({-1, 2, 1}, {2, 0, 0.5}, {0, 1, 0}, s.diffuse(0), {.radiance = {3, 2, 1}});
  s.triangle({3, 0, 0}, {4, 0, 0}, {3, 1, 1}, s.diffuse(0), {.radiance = {1, 1, 1}});
  LightScene scene(s);
  LightTable& lights = scene.scene.lights;
  const std::vector<double> even(size_t{kSide} * kSide, 1);
  lights.emission_guide = BinnedDensity(even, kSide);
  lights.emission_guide.add_table(even);
  lights.emission_guide.add_table(random_weights(5));
  lights.emission_guide_of = {1, 1, -1};
  return scene;
}

/// A path from the light that `pick` chooses.
EmissionSample<float> emit(const LightTable& lights, Random& random, float pick) {
  const float texel = random.uniform(), pu = random.uniform(), pv = random.uniform(), du = random.uniform(),
              dv = random.uniform();
  return sample_emission<float>(lights, pick, texel, pu, pv, du, dv);
}

TEST(EmissionGuide, PathsGoByTheTable) {
  const LightScene scene = aimed_lamp();
  const LightTable& lights = scene.lights();
  constexpr int kSamples = 400000;
  std::vector<double> observed(size_t{kSide} * kSide), expected = observed;
  Random random(6);
  int guided_emission = 0, at_a_border = 0, lost = 0;
  for (int i = 0; i < kSamples; ++i) {
    const auto e = emit(lights, random, random.uniform());
    if (lights.emission_guide_of[static_cast<size_t>(e.light)] < 0) continue;
    ++guided_emission;
    if (e.power.x == 0) {
      ++lost;
      continue;
    }
    const Frame<float> frame(e.normal);
    const auto cell = [&](float x) {
      return std::clamp(static_cast<int>((x + 1) / 2 * kSide), 0, kSide - 1);
    };
    ++observed[static_cast<size_t>(cell(dot(e.direction, frame.t)) * kSide +
                                   cell(dot(e.direction, frame.s)))];
    ASSERT_NEAR(dot(e.direction, e.direction), 1, 1e-5);
    ASSERT_NEAR(dot(e.direction, e.normal), e.cos_light, 1e-5);
    const float p = emission_pdf<float>(lights, e.light, {}, -e.direction, e.cos_light);
    at_a_border += std::fabs(p / e.pdf - 1) > 1e-3f;
  }
  EXPECT_LT(at_a_border, kSamples / 1000);
  // The part of each cell that is on the disk, by a fine grid.
  constexpr int kFine = 64;
  double drawn = 0;
  for (int32_t y = 0; y < kSide * kFine; ++y) {
    for (int32_t x = 0; x < kSide * kFine; ++x) {
      const double a = (x + 0.5) * 2 / (kSide * kFine) - 1, b = (y + 0.5) * 2 / (kSide * kFine) - 1;
      if (a * a + b * b >= 1) continue;
      const auto i = static_cast<size_t>(y / kFine * kSide + x / kFine);
      expected[i] += double{lights.emission_guide.density<float>(1, x / kFine, y / kFine)} * guided_emission /
                     (double{kSide} * kFine * kSide * kFine);
    }
  }
  for (const double e : expected) drawn += e;
  EXPECT_NEAR(lost / (guided_emission - drawn), 1, 0.02);
  EXPECT_TRUE(chi_square_passes(chi_square(observed, expected)));
}

// Radiance x cosine / density adds up to pi A L, as without a guide, and by quadrature densities to 1 / A.
TEST(EmissionGuide, PathsCarryThePower) {
  const LightScene scene = aimed_lamp();
  const LightTable& lights = scene.lights();
  LightTable plain = lights;
  plain.emission_guide_of.clear();
  for (const Vec3<float>& axis : {Vec3<float>{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}) {
    const auto flux_along = [&](const LightTable& of, uint32_t seed) {
      Random random(seed);
      return mean_of(200000, [&] {
        const auto e = emit(of, random, random.uniform());
        const double along = double{dot(e.direction, axis)};
        return double{e.power.y} * (1 + 0.5 * along);
      });
    };
    EXPECT_TRUE(means_agree(flux_along(lights, 1), flux_along(plain, 2), {.resolution = 0.02}));
  }
  const LightRecord<float> r(lights, 0);
  const Frame<float> frame(r.vec(kLightN));
  constexpr int kSteps = 1000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    for (int k = 0; k < kSteps; ++k) {
      const auto x = static_cast<float>((i + 0.5) * 2 / kSteps - 1),
                 y = static_cast<float>((k + 0.5) * 2 / kSteps - 1);
      const float z2 = 1 - x * x - y * y;
      if (z2 <= 0) continue;
      const float z = std::sqrt(z2);
      const Vec3<float> d = frame.to_world({x, y, z});
      sum += double{emission_pdf<float>(lights, 0, {}, -d, z)} / double{z} * 4 / (double{kSteps} * kSteps);
    }
  }
  // Draws in the corners of cells beyond the disk are lost.
  const double chance = sum * r.scalar(kLightArea) / r.scalar(kLightSelect);
  EXPECT_GT(chance, 0.75);
  EXPECT_LT(chance, 1);
}

/// One light of a kind whose directions are those of the whole sphere.
TestScene round_light(int kind) {
  TestScene s;
  s.quad({-1, -1, -1}, {0, 0, 2}, {2, 0, 0}, s.diffuse(0.5f));
  const Vec3d at{0.2, 1, 0.1};
  if (kind == 0) s.point_light(at, {3, 2, 1});
  if (kind == 1) {
    s.scene.lights.push_back({SpotLight{{3, 2, 1}, at, normalized({0.3, -1, 0.2}), 25, 40}, {}});
  }
  if (kind == 2)
    s.triangle(at, at + Vec3d{0.5, 0, 0.1}, at + Vec3d{0, 0.2, 0.4}, s.diffuse(0),
               {.radiance = {3, 2, 1}, .two_sided = true});
  return s;
}

/// Gives all lights one table.
void aim_all(LightTable* lights) {
  lights->emission_guide = BinnedDensity(std::vector<double>(size_t{kSide} * kSide, 1), kSide);
  lights->emission_guide.add_table(random_weights(8));
  lights->emission_guide_of.assign(static_cast<size_t>(lights->count()), 0);
}

TEST(EmissionGuide, RoundLights) {
  for (const int kind : {0, 1, 2}) {
    LightScene scene(round_light(kind));
    const LightTable plain = scene.lights();
    ASSERT_EQ(plain.count(), 1);
    aim_all(&scene.scene.lights);
    const LightTable& lights = scene.lights();
    constexpr int kSamples = 400000;
    std::vector<double> observed(size_t{kSide} * kSide), expected(observed.size());
    for (size_t i = 0; i < expected.size(); ++i) {
      const auto column = static_cast<int32_t>(i % kSide), row = static_cast<int32_t>(i / kSide);
      expected[i] = double{lights.emission_guide.density<float>(0, column, row)} * kSamples /
                    static_cast<double>(expected.size());
    }
    Random random(9);
    int at_a_border = 0;
    const auto measured = [&](const EmissionSample<float>& e) {
      return double{e.power.x} * (1.2 + double{e.direction.x});
    };
    const Estimate power = mean_of(kSamples, [&] {
      const auto e = emit(lights, random, 0);
      float x, y;
      equal_area_sphere_to_square(e.direction, &x, &y);
      const auto cell = [](float t) { return std::min(static_cast<int>(t * kSide), kSide - 1); };
      ++observed[static_cast<size_t>(cell(y) * kSide + cell(x))];
      const float p = emission_pdf<float>(lights, 0, {}, -e.direction, e.cos_light);
      at_a_border += std::fabs(p / e.pdf - 1) > 1e-3f;
      return measured(e);
    });
    EXPECT_TRUE(chi_square_passes(chi_square(observed, expected))) << kind;
    EXPECT_LT(at_a_border, kSamples / 1000) << kind;
    const Estimate without = mean_of(kSamples, [&] { return measured(emit(plain, random, 0)); });
    // A spot is a small part of the sphere, and most paths miss it.
    EXPECT_TRUE(means_agree(power, without, {.resolution = kind == 1 ? 0.05 : 0.02})) << kind;
  }
}

TEST(EmissionGuide, LanesHaveTheBitsOfScalars) {
  TestScene s = mixed_lights();
  s.scene.lights.push_back({SpotLight{{3, 2, 1}, {0, 1, 0}, {0, -1, 0}, 25, 40}, {}});
  s.triangle({0, 2, 0}, {1, 2, 0}, {0, 2, 1}, s.diffuse(0), {.radiance = {3, 2, 1}, .two_sided = true});
  LightScene scene(s);
  aim_all(&scene.scene.lights);
  // Spheres and lights at infinity have none.
  for (size_t i = 0; i < scene.lights().type.size(); ++i) {
    const LightType type = scene.lights().type[i];
    if (type != kTriangleLight && type != kPointLight && type != kSpotLight)
      scene.scene.lights.emission_guide_of[i] = -1;
  }
  Random random(7);
  for (int round = 0; round < 3000; ++round) {
    Float8 x[6];
    for (Float8& f : x) {
      for (int l = 0; l < 8; ++l) f[l] = random.uniform();
    }
    const auto e = sample_emission<Float8>(scene.lights(), x[0], x[1], x[2], x[3], x[4], x[5]);
    const Float8 p = emission_pdf<Float8>(scene.lights(), e.light, e.point, -e.direction, e.cos_light);
    for (int l = 0; l < 8; ++l) {
      const auto t =
          sample_emission<float>(scene.lights(), x[0][l], x[1][l], x[2][l], x[3][l], x[4][l], x[5][l]);
      ASSERT_EQ(e.light[l], t.light);
      ASSERT_EQ(float_bits(e.direction.y[l]), float_bits(t.direction.y));
      ASSERT_EQ(float_bits(e.power.x[l]), float_bits(t.power.x));
      ASSERT_EQ(float_bits(e.pdf[l]), float_bits(t.pdf));
      ASSERT_EQ(float_bits(p[l]),
                float_bits(emission_pdf<float>(scene.lights(), t.light, t.point, -t.direction, t.cos_light)));
    }
  }
}

}  // namespace
}  // namespace lightmill::test
