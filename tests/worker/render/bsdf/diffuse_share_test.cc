// The diffuse part of reflections.
#include "worker/render/bsdf/diffuse_share.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/worker/render/bsdf/bsdf_cases.h"

namespace lightmill::test {
namespace {

/// Calls fn(wo, wi) for pairs on one side, half of them sampled, so that narrow lobes are met.
template <class Fn>
void for_reflections(const BsdfCase& bsdf, Fn&& fn) {
  Random random(23);
  for (int i = 0; i < 2000; ++i) {
    const Vec3<float> wo = square_to_sphere(random.uniform(), random.uniform());
    Vec3<float> wi = square_to_sphere(random.uniform(), random.uniform());
    if (i % 2 == 0) {
      const BsdfSample<float> s = bsdf.sample(wo, random);
      if (!s.valid || s.delta) continue;
      wi = s.wi;
    }
    if (wo.z * wi.z < 0) wi.z = -wi.z;
    if (abs(wo.z) > 1e-2f && abs(wi.z) > 1e-2f) fn(wo, wi);
  }
}

Vec3<float> share_of(const BsdfCase& bsdf, const Vec3<float>& wo, const Vec3<float>& wi) {
  return diffuse_share<float>(bsdf.kind, true, bsdf.params, wo, wi);
}

TEST(DiffuseShare, IsAShareAndTheSameBothWays) {
  for (const BsdfCase& bsdf : all_bsdfs()) {
    SCOPED_TRACE(bsdf.name);
    const float tolerance = bsdf.alpha > 0 ? 1e-4f + 1e-5f / (bsdf.alpha * bsdf.alpha) : 1e-4f;
    for_reflections(bsdf, [&](const Vec3<float>& wo, const Vec3<float>& wi) {
      const Vec3<float> there = share_of(bsdf, wo, wi), back = share_of(bsdf, wi, wo);
      for (const auto& [a, b] : {std::pair{there.x, back.x}, {there.y, back.y}, {there.z, back.z}}) {
        ASSERT_GE(a, 0);
        ASSERT_LE(a, 1);
        ASSERT_NEAR(a, b, tolerance);
      }
    });
  }
}

TEST(DiffuseShare, IsAllOrNothingOfOneLobe) {
  for (const BsdfCase& bsdf : all_bsdfs()) {
    if (reflects_both_ways(bsdf.kind) || bsdf.kind == kToon) continue;
    SCOPED_TRACE(bsdf.name);
    const float expected = reflects_diffusely_alone(bsdf.kind) ? 1 : 0;
    for_reflections(bsdf, [&](const Vec3<float>& wo, const Vec3<float>& wi) {
      const Vec3<float> share = share_of(bsdf, wo, wi);
      ASSERT_EQ(share.x, expected);
      ASSERT_EQ(share.z, expected);
    });
  }
}

// The oracle: f is linear in the base's colour, so the diffuse part is what a black base takes away.
TEST(DiffuseShare, IsWhatABlackBaseTakesAway) {
  const auto is_base_alone = [](int32_t kind) {
    return kind == kRoughCoated || kind == kMetallicRoughness || kind == kCoatedMetallicRoughness ||
           kind == kAnisotropicMetallicRoughness || kind == kTranslucent;
  };
  int kinds = 0;
  for (const BsdfCase& bsdf : all_bsdfs()) {
    if (!is_base_alone(bsdf.kind)) continue;
    SCOPED_TRACE(bsdf.name);
    ++kinds;
    BsdfCase black = bsdf;
    for (size_t c = 0; c < 3; ++c) black.params.p[c] = 0;
    for_reflections(bsdf, [&](const Vec3<float>& wo, const Vec3<float>& wi) {
      const Vec3<float> f = bsdf.eval(wo, wi).f, glossy = black.eval(wo, wi).f,
                        share = share_of(bsdf, wo, wi);
      ASSERT_NEAR(f.x * share.x, f.x - glossy.x, 1e-5f * std::max(f.x, 0.1f));
      ASSERT_NEAR(f.y * share.y, f.y - glossy.y, 1e-5f * std::max(f.y, 0.1f));
    });
  }
  EXPECT_GT(kinds, 10);
}

}  // namespace
}  // namespace lightmill::test
