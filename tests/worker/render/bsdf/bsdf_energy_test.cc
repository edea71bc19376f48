// No BSDF makes energy; the lossless ones lose none.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/worker/render/bsdf/bsdf_cases.h"

namespace lightmill::test {
namespace {

/// Mean weight over all lobes: the directional albedo (of importance, which carries no 1 / eta^2; of measured
/// tables that of radiance, as they are only as reciprocal as their nodes are dense, and of Blender's glass
/// and Toon, where the directions of a pair count differently).
Estimate albedo(const BsdfCase& bsdf, const Vec3<float>& wo, int samples) {
  Random random(21);
  const bool of_radiance = bsdf.kind == kMeasured || bsdf.kind == kRoughGlass || bsdf.kind == kToon;
  const Mode mode = of_radiance ? Mode::kRadiance : Mode::kImportance;
  std::vector<double> batches(32);
  for (double& b : batches) {
    for (int i = 0; i < samples / 32; ++i) {
      const BsdfSample<float> s = bsdf.sample(wo, random, mode);
      if (s.valid) b += max_component(s.weight) / static_cast<float>(samples / 32);
    }
  }
  return estimate(batches);
}

// |z| < 4; rough coats take their energy from tables: 0.5 % is allowed there.
TEST(BsdfEnergy, AlbedoIsAtMostOne) {
  for (const BsdfCase& bsdf : all_bsdfs()) {
    if (bsdf.kind == kHair) continue;  // its cosines are not those of a surface: hair_test.cc
    // Their lobes are added up as they are; what is not refracted is lost.
    if (bsdf.name.starts_with("blender_principled") || bsdf.name == "blender_refraction") continue;
    if (bsdf.kind == kSharpGlass) continue;  // a delta with the adjoint's 1 / eta^2: blender_test.cc
    if (bsdf.kind == kIridescent) continue;  // channels, not samples, keep to one: thin_film_test.cc
    const bool tabulated =
        bsdf.kind == kRoughCoated || bsdf.kind == kCoatedConductor || bsdf.kind == kRoughCoatedConductor ||
        bsdf.kind == kMetallicRoughness || bsdf.kind == kCoatedMetallicRoughness ||
        bsdf.kind == kSheenMetallicRoughness || bsdf.kind == kTranslucent ||
        bsdf.kind == kAnisotropicMetallicRoughness || bsdf.kind == kRoughTintedSheet ||
        bsdf.name.starts_with("milky") || bsdf.kind == kMeasured || bsdf.kind == kAnisotropicCoated ||
        bsdf.kind == kAnisotropicCoatedConductor || bsdf.kind == kAnisotropicRoughCoatedConductor;
    const double allowance = tabulated ? 0.005 : 1e-5;
    for (const double degrees : {0.0, 30.0, 60.0, 80.0, 88.0, 92.0, 100.0, 150.0, 180.0}) {
      const Estimate e = albedo(bsdf, direction_at(degrees), 16000);
      EXPECT_LE(e.mean, 1 + 4 * e.standard_error + allowance) << bsdf.name << " at " << degrees;
      EXPECT_GT(e.mean, 0.01) << bsdf.name << " at " << degrees;
    }
  }
}

TEST(BsdfEnergy, LosslessKindsLoseNothing) {
  for (const BsdfCase& bsdf : all_bsdfs()) {
    const bool lossless = bsdf.name == "diffuse_white" || bsdf.kind == kSmoothDielectric ||
                          bsdf.kind == kTintedSheet || bsdf.name == "gltf_glass" ||
                          bsdf.kind == kThinDielectric ||
                          (bsdf.kind == kDiffuseTransmission && bsdf.name != "sheet_colour" &&
                           bsdf.name != "blender_translucent");
    if (!lossless) continue;
    for (const Vec3<float>& wo : outgoing_directions()) {
      const Estimate e = albedo(bsdf, wo, 3200);
      EXPECT_NEAR(e.mean, 1, 1e-6) << bsdf.name << " cos " << wo.z;
    }
  }
}

// glTF's lobes keep their energy: in a white furnace a white metal, a white dielectric and a clear sheet stay
// white within 1 %, whatever the roughness, in every direction that is not grazing.
TEST(BsdfEnergy, GltfMaterialsStayWhite) {
  int found = 0;
  for (const BsdfCase& bsdf : all_bsdfs()) {
    const bool sheet = bsdf.kind == kRoughTintedSheet && bsdf.name != "gltf_sheet_tinted";
    if (!bsdf.name.starts_with("gltf_white") && !sheet && bsdf.name != "leaf_white") continue;
    ++found;
    for (const double degrees : {0.0, 30.0, 60.0, 75.0, 80.0, 120.0}) {
      const Estimate e = albedo(bsdf, direction_at(degrees), 64000);
      EXPECT_NEAR(e.mean, 1, 0.01 + 4 * e.standard_error) << bsdf.name << " at " << degrees;
    }
  }
  EXPECT_EQ(found, 12);
}

// Single scattering loses what is masked: a smooth interface none, more with roughness.
TEST(BsdfEnergy, RoughConductorTendsToTheMirror) {
  BsdfCase c{"perfect", kRoughConductor, {}, 0};
  for (const size_t i : {0u, 1u, 2u}) c.params.p[i] = 1;
  for (const size_t i : {3u, 4u, 5u}) c.params.p[i] = 1e6f;  // F = 1
  double last = 1 + 1e-4;
  for (const float alpha : {1e-3f, 1e-2f, 0.1f, 0.5f, 1.0f}) {
    c.params.p[6] = alpha;
    const double a = albedo(c, direction_at(60), 64000).mean;
    EXPECT_LE(a, last) << "alpha " << alpha;
    if (alpha <= 1e-2f) {
      EXPECT_NEAR(a, 1, 2e-3) << "alpha " << alpha;
    }
    last = a;
  }
}

// Oracle 15: the albedo of GGX with F = 1 by quadrature over the hemisphere.
TEST(BsdfEnergy, RoughConductorAlbedoByQuadrature) {
  BsdfCase c{"perfect", kRoughConductor, {}, 0};
  for (const size_t i : {0u, 1u, 2u}) c.params.p[i] = 1;
  for (const size_t i : {3u, 4u, 5u}) c.params.p[i] = 1e6f;
  for (const float alpha : {0.3f, 0.6f, 1.0f}) {
    c.params.p[6] = alpha;
    for (const double degrees : {0.0, 45.0, 75.0}) {
      const Vec3<float> wo = direction_at(degrees);
      constexpr int kSteps = 512;
      double sum = 0;
      for (int i = 0; i < kSteps; ++i) {
        for (int j = 0; j < kSteps; ++j) {
          const double t = M_PI / 2 * (i + 0.5) / kSteps, p = 2 * M_PI * (j + 0.5) / kSteps;
          const Vec3<float> wi = direction_at(t * 180 / M_PI, p);
          sum += double{c.eval(wo, wi).f.x} * std::cos(t) * std::sin(t) * (M_PI / 2) * (2 * M_PI) /
                 (kSteps * kSteps);
        }
      }
      EXPECT_TRUE(mean_is(albedo(c, wo, 128000), sum, {.resolution = 0.02, .rounding = 1e-3}))
          << "alpha " << alpha << " at " << degrees;
    }
  }
}

}  // namespace
}  // namespace lightmill::test
