// Noise and the textures made of it; mappings against their formulas.
#include "worker/render/scene/textures/procedural.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/statistics.h"
#include "worker/render/scene/textures/noise.h"

namespace lightmill::test {
namespace {

NoisePoint random_point(Random* random, double size) {
  const auto x = [&] { return static_cast<float>(random->between(-size, size)); };
  return {x(), x(), x()};
}

TEST(Noise, VanishesOnTheLatticeIsBoundedAndRepeatsAfter256) {
  Random random(1);
  double sum = 0, square = 0;
  constexpr int kTrials = 20000;
  for (int i = 0; i < kTrials; ++i) {
    const NoisePoint p = random_point(&random, 100);
    EXPECT_EQ(gradient_noise({std::floor(p.x), std::floor(p.y), std::floor(p.z)}), 0);
    const float n = gradient_noise(p);
    ASSERT_LE(std::fabs(n), 1.0f);
    const float eighth = std::round(p.x * 8) / 8;  // exact after adding the period
    EXPECT_EQ(gradient_noise({eighth, p.y, p.z}), gradient_noise({eighth + 256, p.y, p.z}));
    sum += n;
    square += n * n;
  }
  EXPECT_NEAR(sum / kTrials, 0, 0.01);
  EXPECT_NEAR(std::sqrt(square / kTrials), 0.28, 0.04);  // flat or wild noise would miss this
}

// A broken permutation would jump across cell walls.
TEST(Noise, IsSmoothAcrossCells) {
  Random random(2);
  for (int i = 0; i < 5000; ++i) {
    NoisePoint p = random_point(&random, 300);
    p.x = std::floor(p.x);
    const float below = gradient_noise({p.x - 1e-3f, p.y, p.z}),
                above = gradient_noise({p.x + 1e-3f, p.y, p.z});
    EXPECT_NEAR(below, above, 0.006);
  }
}

TEST(Noise, WildCoordinatesAreFinite) {
  for (const float x : {1e30f, -1e30f, std::numeric_limits<float>::infinity(), std::nanf("")}) {
    EXPECT_TRUE(std::isfinite(gradient_noise({x, 0.3f, x})));
    EXPECT_TRUE(std::isfinite(turbulence({x, x, x}, 2, 64)));
  }
}

TEST(Noise, OctavesAddUp) {
  const NoisePoint p{0.3f, 1.7f, -2.4f};
  EXPECT_FLOAT_EQ(fractal_noise(p, 0.5f, 1), gradient_noise(p));
  const float second = gradient_noise({1.99f * p.x, 1.99f * p.y, 1.99f * p.z});
  EXPECT_FLOAT_EQ(fractal_noise(p, 0.5f, 2), gradient_noise(p) + 0.5f * second);
  EXPECT_FLOAT_EQ(turbulence(p, 0.25f, 2), std::fabs(gradient_noise(p)) + 0.25f * std::fabs(second));
}

TexturePoint at(const Vec3d& p) { return {0.2f, 0.7f, p}; }

TEST(Mapping, FollowsItsFormula) {
  UvMapping m{2, 3, 0.1f, 0.2f};
  EXPECT_FLOAT_EQ(map_point(m, at({})).s, 0.5f);
  EXPECT_FLOAT_EQ(map_point(m, at({})).t, 2.3f);
  m.kind = MappingKind::kPlanar;
  m.s_axis = {0, 0, 2};
  m.world_to_texture.m[2][3] = 1;  // z + 1
  EXPECT_FLOAT_EQ(map_point(m, at({5, 6, 7})).s, 0.1f + 2 * 8);
  EXPECT_FLOAT_EQ(map_point(m, at({5, 6, 7})).t, 0.2f + 6);
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const Vec3d p{random.between(-2, 2), random.between(-2, 2), random.between(-2, 2)};
    const double r = std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z), phi = std::atan2(p.y, p.x);
    UvMapping sphere, cylinder;
    sphere.kind = MappingKind::kSpherical;
    cylinder.kind = MappingKind::kCylindrical;
    EXPECT_NEAR(map_point(sphere, at(p)).s, std::acos(p.z / r) / M_PI, 2e-6);
    EXPECT_NEAR(map_point(sphere, at(p)).t, phi / (2 * M_PI) + (phi < 0 ? 1 : 0), 2e-6);
    EXPECT_NEAR(map_point(cylinder, at(p)).s, (M_PI + phi) / (2 * M_PI), 2e-6);
    EXPECT_NEAR(map_point(cylinder, at(p)).t, p.z, 2e-6);
  }
}

TEST(Procedural, BilerpInterpolatesItsCorners) {
  BilerpTexture b;
  b.v00 = {1, 1, 1}, b.v01 = {2, 2, 2}, b.v10 = {3, 3, 3}, b.v11 = {5, 5, 5};
  EXPECT_FLOAT_EQ(bilerp(b, {0, 1, {}}).r, 2);
  EXPECT_FLOAT_EQ(bilerp(b, {1, 0, {}}).g, 3);
  EXPECT_FLOAT_EQ(bilerp(b, {0.5f, 0.5f, {}}).b, 2.75f);
}

TEST(Procedural, DirectionMixFollowsTheNormalOfEitherSide) {
  const DirectionMixTexture mix{{{1, 0, 0.5f}, -1}, {{0, 1, 0.5f}, -1}, {0, 0.6, 0.8}};
  const TextureTable table(std::vector<TextureDescription>{{"mix", true, mix, {}}});
  TexturePoint point = at({});
  for (const float side : {1.0f, -1.0f}) {
    point.n = {0, 0, side};
    const Rgb c = table.evaluate(0, point);
    EXPECT_FLOAT_EQ(c.r, 0.8f);
    EXPECT_FLOAT_EQ(c.g, 0.2f);
    EXPECT_FLOAT_EQ(c.b, 0.5f);
  }
}

TEST(Procedural, SolidCheckerboardAlternatesAlongEveryAxis) {
  CheckerboardTexture board;
  board.solid = true;
  const bool here = second_square(board, at({0.5, 0.5, 0.5}));
  EXPECT_NE(second_square(board, at({1.5, 0.5, 0.5})), here);
  EXPECT_NE(second_square(board, at({0.5, -0.5, 0.5})), here);
  EXPECT_NE(second_square(board, at({0.5, 0.5, 1.5})), here);
  EXPECT_EQ(second_square(board, at({1.5, 1.5, 0.5})), here);
}

// About half of the cells have a dot of area pi 0.35^2; no dot is cut at its cell's wall.
TEST(Procedural, DotsCoverWhatTheyShould) {
  Random random(4);
  int inside = 0, at_walls = 0;
  constexpr int kTrials = 40000;
  for (int i = 0; i < kTrials; ++i) {
    const auto s = static_cast<float>(random.between(-60, 60)),
               t = static_cast<float>(random.between(-60, 60));
    inside += inside_dot({s, t});
    at_walls += inside_dot({std::floor(s) + 0.5f, t});
  }
  EXPECT_NEAR(double{1} * inside / kTrials, 0.5 * M_PI * 0.35 * 0.35, 0.06);
  EXPECT_EQ(at_walls, 0);
}

TEST(Procedural, MarbleStaysWithinItsColours) {
  NoiseTexture t;
  t.kind = NoiseKind::kMarble;
  t.scale = 3;
  Random random(5);
  float low = 2, high = 0;
  for (int i = 0; i < 5000; ++i) {
    const Rgb c = noise_color(t, at({random.between(-9, 9), random.between(-9, 9), random.between(-9, 9)}));
    low = std::min(low, c.r);
    high = std::max(high, c.r);
  }
  EXPECT_GE(low, 0.29f);
  EXPECT_LE(high, 0.91f);
  EXPECT_GT(high - low, 0.2f);
}

}  // namespace
}  // namespace lightmill::test
