// A mix chooses by its amount, the same for the same point, through nested mixes, and on both lane widths.
#include "worker/render/scene/materials/mix.h"

#include <gtest/gtest.h>

#include <array>

#include "common/base/error.h"
#include "tests/support/statistics.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

TEST(Mix, SharesAreTheAmounts) {
  TestScene s;
  const int a = s.diffuse(0.1f), b = s.conductor(0.9f, 0.2f), c = s.dielectric(1.5f, 0);
  const int inner = s.mix(b, c, 0.25f), outer = s.mix(a, inner, 0.6f);
  const int all_first = s.mix(a, b, 0), all_second = s.mix(a, b, 1);
  s.sphere({0, 0, 0}, 1, outer);
  const RenderScene scene = build_scene(s.scene);
  EXPECT_TRUE(scene.any_mix);
  EXPECT_TRUE(scene.any_delta);  // of a child's child
  EXPECT_EQ(scene.kinds_present, 4);
  Random random(1);
  std::array<double, 3> counts{};
  constexpr int kPoints = 60000;
  for (int i = 0; i < kPoints; ++i) {
    const float p[3] = {random.uniform(), random.uniform(), 0.5f};  // one coordinate may be constant
    const MixChoice choice = resolve_mix(scene, outer, 0, p, {});
    const int32_t m = choice.material;
    ASSERT_EQ(m, resolve_mix(scene, outer, 0, p, {}).material);
    ASSERT_EQ(choice.scale, 1);  // by pbrt's rule
    ASSERT_TRUE(m == a || m == b || m == c);
    ++counts[m == a ? 0u : m == b ? 1u : 2u];
    ASSERT_EQ(resolve_mix(scene, all_first, 0, p, {}).material, a);
    ASSERT_EQ(resolve_mix(scene, all_second, 0, p, {}).material, b);
  }
  const std::array<double, 3> expected = {0.4 * kPoints, 0.6 * 0.75 * kPoints, 0.6 * 0.25 * kPoints};
  EXPECT_TRUE(chi_square_passes(chi_square(counts, expected)));
}

// Evenly spaced numbers give every part of nested mixes its share, to within the ends of its intervals.
TEST(Mix, EvenNumbersGiveExactShares) {
  TestScene s;
  const int a = s.diffuse(0.1f), b = s.conductor(0.9f, 0.2f), c = s.dielectric(1.5f, 0);
  const int inner = s.mix(b, c, 0.25f), outer = s.mix(a, inner, 0.6f);
  s.sphere({0, 0, 0}, 1, outer);
  const RenderScene scene = build_scene(s.scene);
  const float p[3] = {0.3f, 0.4f, 0.5f};
  std::array<int, 3> counts{};
  constexpr int kNumbers = 1000;
  for (int i = 0; i < kNumbers; ++i) {
    const float u = (static_cast<float>(i) + 0.5f) / kNumbers;
    const int32_t m = resolve_mix(scene, outer, 0, p, {}, u).material;
    ++counts[m == a ? 0u : m == b ? 1u : 2u];
  }
  EXPECT_NEAR(counts[0], 0.4 * kNumbers, 1);
  EXPECT_NEAR(counts[1], 0.6 * 0.75 * kNumbers, 1);
  EXPECT_NEAR(counts[2], 0.6 * 0.25 * kNumbers, 1);
  EXPECT_EQ(resolve_mix(scene, outer, 0, p, {}, 1 - 0x1p-24f).material, a);
}

TEST(Mix, LanesChooseAsTheScalar) {
  TestScene s;
  const int a = s.diffuse(0.1f), b = s.diffuse(0.9f), mixed = s.mix(a, b, 0.5f);
  s.sphere({0, 0, 0}, 1, mixed);
  const RenderScene scene = build_scene(s.scene);
  Random random(2);
  for (int round = 0; round < 100; ++round) {
    Surface<Float8> at;
    Int8 material{}, prim{}, active{};
    for (int l = 0; l < 8; ++l) {
      at.p.x[l] = random.uniform(), at.p.y[l] = random.uniform(), at.p.z[l] = random.uniform();
      material[l] = l % 3 == 0 ? a : mixed;
      active[l] = l == 5 ? 0 : -1;
    }
    Float8 scale = splat<Float8>(1.0f);
    const Int8 chosen = resolve_mixes<Float8>(scene, material, active, prim, at, &scale);
    for (int l = 0; l < 8; ++l) {
      const float p[3] = {at.p.x[l], at.p.y[l], at.p.z[l]};
      EXPECT_EQ(chosen[l], active[l] ? resolve_mix(scene, material[l], 0, p, {}).material : material[l]);
      EXPECT_EQ(scale[l], 1);
    }
  }
}

TEST(Mix, CyclesAreRefused) {
  TestScene s;
  const int a = s.diffuse(0.5f), mixed = s.mix(a, a, 0.5f);
  std::get<MixMaterial>(s.scene.materials[static_cast<size_t>(mixed)].kind).materials[1] = mixed;
  s.sphere({0, 0, 0}, 1, mixed);
  EXPECT_THROW(build_scene(s.scene), Error);
}

}  // namespace
}  // namespace lightmill::test
