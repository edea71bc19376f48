// Reciprocity of f, and of the densities that MIS needs in both directions.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/worker/render/bsdf/bsdf_cases.h"

namespace lightmill::test {
namespace {

/// Pairs of directions: half of them uniform, half with wi sampled, so that narrow lobes are met.
template <class Fn>
void for_pairs(const BsdfCase& bsdf, Fn&& fn) {
  Random random(11);
  for (int i = 0; i < 4000; ++i) {
    const Vec3<float> wo = square_to_sphere(random.uniform(), random.uniform());
    if (abs(wo.z) < 1e-3f) continue;
    Vec3<float> wi = square_to_sphere(random.uniform(), random.uniform());
    if (i % 2 == 0) {
      const BsdfSample<float> s = bsdf.sample(wo, random);
      if (!s.valid || s.delta) continue;
      wi = s.wi;
    }
    if (abs(wi.z) < 1e-3f) continue;
    fn(wo, wi);
  }
}

float tolerance(const BsdfCase& bsdf) {
  return bsdf.alpha > 0 ? 5e-5f + 4e-6f / (bsdf.alpha * bsdf.alpha) : 5e-5f;
}

TEST(BsdfSymmetry, ReverseDensityIsTheDensityOfTheExchangedPair) {
  for (const BsdfCase& bsdf : all_bsdfs()) {
    if (is_pure_delta(bsdf.kind)) continue;
    SCOPED_TRACE(bsdf.name);
    int compared = 0;
    for_pairs(bsdf, [&](const Vec3<float>& wo, const Vec3<float>& wi) {
      const BsdfEval<float> forward = bsdf.eval(wo, wi), backward = bsdf.eval(wi, wo);
      const float t = tolerance(bsdf);
      ASSERT_NEAR(forward.pdf_reverse, backward.pdf, t * std::max(backward.pdf, 3e-2f))
          << wo.z << " " << wi.z;
      ASSERT_NEAR(forward.pdf, backward.pdf_reverse, t * std::max(forward.pdf, 3e-2f)) << wo.z << " " << wi.z;
      compared += forward.pdf > 0;
    });
    EXPECT_GT(compared, 1000);
  }
}

bool refracts(const BsdfCase& bsdf) {
  return bsdf.kind == kRoughDielectric || bsdf.kind == kAnisotropicDielectric ||
         bsdf.kind == kRoughTintedDielectric;
}

TEST(BsdfSymmetry, ReflectionIsReciprocalAndTransmissionByTheSquaredIndex) {
  for (const BsdfCase& bsdf : all_bsdfs()) {
    if (is_pure_delta(bsdf.kind) || bsdf.kind == kHair) continue;  // hair: hair_test.cc
    SCOPED_TRACE(bsdf.name);
    int transmitted = 0;
    for_pairs(bsdf, [&](const Vec3<float>& wo, const Vec3<float>& wi) {
      const auto radiance = bsdf.eval(wo, wi), importance = bsdf.eval(wo, wi, Mode::kImportance);
      const auto exchanged = bsdf.eval(wi, wo), exchanged_importance = bsdf.eval(wi, wo, Mode::kImportance);
      const float scale = tolerance(bsdf) * std::max(importance.f.y, 3e-2f);
      // The adjoint: importance from wo to wi scatters as radiance from wi to wo.
      ASSERT_NEAR(importance.f.y, exchanged.f.y, scale) << wo.z << " " << wi.z;
      if (bsdf.kind == kRoughGlass || bsdf.kind == kToon) {
        // Not reciprocal: what the adjoint says is all.
      } else if (bsdf.kind == kMeasured) {
        // Tables are reciprocal only as far as their nodes go: measured_test.cc.
      } else if (wo.z * wi.z > 0) {
        ASSERT_EQ(radiance.f.y, importance.f.y);
      } else if (refracts(bsdf)) {
        // f(wo -> wi) = f*(wo -> wi) / eta^2 with eta = n(wi) / n(wo); f* is symmetric up to the same square.
        const float eta = wo.z > 0 ? bsdf.params.p[0] : 1 / bsdf.params.p[0];
        ASSERT_NEAR(radiance.f.y * eta * eta, importance.f.y, scale);
        ASSERT_NEAR(exchanged_importance.f.y * eta * eta, importance.f.y, scale * std::max(1.0f, eta * eta));
        transmitted += radiance.f.y > 0;
      } else if (bsdf.kind == kDiffuseTransmission) {
        ASSERT_EQ(radiance.f.y, importance.f.y);  // no interface: no squared index
        ASSERT_FLOAT_EQ(radiance.f.y, bsdf.params.p[4] * kInvPi);
      } else if (bsdf.kind == kRoughTintedSheet || bsdf.kind == kTranslucent) {
        ASSERT_EQ(radiance.f.y, importance.f.y);
      } else {
        ASSERT_EQ(radiance.f.y, 0);
      }
    });
    if (refracts(bsdf)) {
      EXPECT_GT(transmitted, 200);
    }
  }
}

}  // namespace
}  // namespace lightmill::test
