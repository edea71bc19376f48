// Selection by power, a sixteenth of it even: the alias table follows the probabilities that the densities
// use.
#include "worker/render/light/light_table.h"

#include <gtest/gtest.h>

#include <array>

#include "tests/worker/render/light/light_cases.h"

namespace lightmill::test {
namespace {

LightTable table_of(const std::vector<double>& powers) {
  LightTable t;
  for (const double p : powers) {
    std::array<float, kLightFloats> record{};
    record[kLightArea] = 1;
    t.add(kTriangleLight, record, p);
  }
  t.finish();
  return t;
}

float selection(const LightTable& t, size_t i) { return t.records[i * kLightFloats + kLightSelect]; }

/// Of a light with `part` of the power of `count`.
double expected_selection(double part, size_t count) {
  return part * 15 / 16 + 1.0 / 16 / static_cast<double>(count);
}

void check(const std::vector<double>& powers) {
  const LightTable t = table_of(powers);
  constexpr int kSamples = 400000;
  Random random(1);
  std::vector<double> observed(powers.size()), expected(powers.size());
  double total = 0, sum = 0;
  for (const double p : powers) total += p;
  for (size_t i = 0; i < powers.size(); ++i) {
    EXPECT_NEAR(selection(t, i), expected_selection(powers[i] / total, powers.size()), 1e-6);
    sum += selection(t, i);
    expected[i] = double{selection(t, i)} * kSamples;
  }
  EXPECT_NEAR(sum, 1, 1e-5);
  for (int i = 0; i < kSamples; ++i)
    ++observed[static_cast<size_t>(select_light<float>(t, random.uniform()))];
  EXPECT_TRUE(chi_square_passes(chi_square(observed, expected), 5));
}

TEST(LightTable, EqualPowers) { check(std::vector<double>(7, 1.0)); }
TEST(LightTable, PowersOverManyDecades) { check({1e5, 1, 10, 3e4, 1e-3, 700}); }
TEST(LightTable, TwoLights) { check({0.25, 0.75}); }
TEST(LightTable, ManyLights) {
  Random random(3);
  std::vector<double> powers(1000);
  for (double& p : powers) p = random.between(0, 1) * random.between(0, 1);
  check(powers);
}

// What is left of the number that chose is uniform for each light, and stratified: of N even numbers each
// light gets its share, give or take one for each of the pieces that its share is made of, and so does every
// part of its rest.
TEST(LightTable, WhatIsLeftOfTheChoiceIsStratified) {
  constexpr int kNumbers = 1 << 14, kParts = 8;
  for (const std::vector<double>& powers :
       {std::vector<double>(2, 1.0), std::vector<double>(5, 1.0), std::vector<double>{4, 1, 2, 9}}) {
    const LightTable t = table_of(powers);
    std::vector<std::array<int, kParts>> counts(powers.size());
    for (int i = 0; i < kNumbers; ++i) {
      float rest = -1;
      const int32_t light = select_alias<float>(t.direct_keep, t.direct_alias,
                                                (static_cast<float>(i) + 0.5f) / kNumbers, &rest);
      ASSERT_GE(rest, 0);
      ASSERT_LT(rest, 1);
      ++counts[static_cast<size_t>(light)][static_cast<size_t>(rest * kParts)];
    }
    for (size_t light = 0; light < powers.size(); ++light) {
      const double expected = double{selection(t, light)} * kNumbers / kParts;
      for (const int n : counts[light]) EXPECT_NEAR(n, expected, 2.0 * static_cast<double>(powers.size()));
    }
  }
}

// A light without power is never chosen, and one with hardly any still is.
TEST(LightTable, DarkLightsAreNotChosen) {
  const LightTable t = table_of({1e9, 0, 1});
  EXPECT_EQ(selection(t, 1), 0);
  EXPECT_NEAR(selection(t, 2), 1.0 / 32, 1e-6);
}

TEST(LightTable, OneLightAndNoPower) {
  EXPECT_EQ(select_light<float>(table_of({3}), 0.9f), 0);
  const LightTable dark = table_of({0, 0});
  EXPECT_FLOAT_EQ(selection(dark, 0), 0.5f);
}

TEST(LightTable, TheLargestUniformSelectsALight) {
  const LightTable t = table_of({1, 2, 3});
  for (const float u : {0.0f, 0.5f, 1 - 0x1p-24f}) {
    const int32_t i = select_light<float>(t, u);
    EXPECT_TRUE(i >= 0 && i < 3);
  }
}

// Selection follows power through the scene builder as well: 4 pi^2 r^2 L for a sphere, pi A L
// for a triangle.
TEST(LightTable, SceneBuilderGivesPowers) {
  TestScene s;
  const int black = s.diffuse(0);
  s.sphere({0, 0, 4}, 1, black, {.radiance = {1, 1, 1}});
  s.triangle({0, 0, 3}, {1, 0, 3}, {0, 1, 3}, black, {.radiance = {4, 4, 4}});
  s.triangle({0, 0, 2}, {1, 0, 2}, {0, 1, 2}, black, {.radiance = {4, 4, 4}, .two_sided = true});
  s.point_light({0, 1, 0}, {1, 1, 1});
  const LightScene scene(s);
  const double triangle = M_PI * 0.5 * 4, both = 2 * triangle, sphere = M_PI * 4 * M_PI, point = 4 * M_PI;
  const double total = triangle + both + sphere + point;
  // Order: triangles, spheres, then the others.
  const double expected[4] = {triangle / total, both / total, sphere / total, point / total};
  for (size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(selection(scene.lights(), i), expected_selection(expected[i], 4), 1e-6) << i;
}

}  // namespace
}  // namespace lightmill::test
