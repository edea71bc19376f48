// Measured BRDFs made of known ones: what the tables say is what was tabulated, up to their resolution, which
// must show.
#include "worker/render/bsdf/measured.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/measured_file.h"
#include "tests/support/test_scene.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill::test {
namespace {

/// A table as a scene has it.
struct Tabulated {
  explicit Tabulated(const TabulatedBrdf& brdf) : scene(built(brdf)) {
    of.kind = scene.material_kind[0];
    of.params.tables = scene.bsdf_tables.data();
    for (size_t k = 0; k < kBsdfParams; ++k) of.params.p[k] = scene.material_params[k];
  }
  static RenderScene built(const TabulatedBrdf& brdf) {
    TestScene s;
    s.scene.materials.push_back({"", measured_material(brdf), {}});
    s.sphere({0, 0, 0}, 1, 0);
    return build_scene(s.scene);
  }
  RenderScene scene;
  BsdfCase of{"table", kMeasured, {}};
};

Vec3d to_double(const Vec3<float>& v) { return {double{v.x}, double{v.y}, double{v.z}}; }

/// Root of the mean squared difference of f cos between table and original over the root mean square of the
/// latter, for a viewer up to 70 degrees off and all lights.
double difference(const TabulatedBrdf& brdf) {
  const Tabulated table(brdf);
  Random random(8);
  double error = 0, size = 0;
  for (int k = 0; k < 20000; ++k) {
    const Vec3<float> o = direction_at(70 * double{random.uniform()}, 2 * M_PI * double{random.uniform()});
    const Vec3<float> i = square_to_cosine_hemisphere(random.uniform(), random.uniform());
    if (i.z < 0.02f) continue;
    const double expected = brdf.f(to_double(o), to_double(i));
    const double found = double{table.of.eval(o, i).f.y};
    error += (found - expected) * (found - expected);
    size += expected * expected;
  }
  return std::sqrt(error / size);
}

/// Directional table_albedo for camera paths.
Estimate table_albedo(const BsdfCase& bsdf, double degrees) {
  Random random(9);
  std::vector<double> batches(32);
  const Vec3<float> wo = direction_at(degrees);
  for (double& b : batches) {
    for (int k = 0; k < 2000; ++k) {
      const BsdfSample<float> s = bsdf.sample(wo, random);
      if (s.valid) b += double{s.weight.y} / 2000;
    }
  }
  return estimate(batches);
}

TabulatedBrdf lambert(int nodes) {
  TabulatedBrdf b;
  b.f = [](const Vec3d&, const Vec3d&) { return 0.7 / M_PI; };
  b.facets = b.warped = nodes;
  b.zeniths = nodes / 2;
  return b;
}

TEST(Measured, ATableOfAConstantIsDiffuse) {
  const double coarse = difference(lambert(16)), fine = difference(lambert(48));
  EXPECT_LT(coarse, 0.1);
  EXPECT_LT(fine, 0.025);
  EXPECT_LT(fine, coarse / 2);
  const Tabulated table(lambert(48));
  for (const double degrees : {0.0, 20.0, 45.0, 70.0})
    EXPECT_TRUE(mean_is(table_albedo(table.of, degrees), 0.7, {.resolution = 0.02, .rounding = 0.01}))
        << degrees;
}

TEST(Measured, ATableOfMicrofacetsIsAMetal) {
  TabulatedBrdf b;
  b.f = ggx_brdf(0.4, 0.4);
  b.alpha = 0.4;
  b.facets = b.warped = 48;
  b.zeniths = 24;
  EXPECT_LT(difference(b), 0.03);
  const Tabulated table(b);
  BsdfCase metal{"metal", kRoughConductor, {}, 0.4f};
  for (const size_t i : {0u, 1u, 2u}) metal.params.p[i] = 1;
  for (const size_t i : {3u, 4u, 5u}) metal.params.p[i] = 1e6f;
  metal.params.p[6] = 0.4f;
  for (const double degrees : {0.0, 30.0, 60.0}) {
    const double expected = table_albedo(metal, degrees).mean;
    EXPECT_TRUE(mean_is(table_albedo(table.of, degrees), expected, {.resolution = 0.02, .rounding = 0.01}))
        << degrees;
  }
}

// Brushed: which way facets lie shows, and the table's tangent is the surface's.
TEST(Measured, ATableOfManyAzimuthsIsAnisotropic) {
  TabulatedBrdf b;
  b.f = ggx_brdf(0.6, 0.3);
  b.alpha = 0.45;
  b.azimuths = 33;
  b.zeniths = 12;
  b.facets = b.warped = 32;
  EXPECT_LT(difference(b), 0.06);
  Tabulated table(b);
  const Vec3<float> o = direction_at(0, 0), along = direction_at(40, 0), across = direction_at(40, M_PI / 2);
  EXPECT_GT(table.of.eval(o, along).f.y, 1.5f * table.of.eval(o, across).f.y);
  const float before = table.of.eval(o, along).f.y;
  table.of.params.p[9] = 0.25f;
  EXPECT_NEAR(table.of.eval(o, across).f.y / before, 1, 1e-2);
}

// Two views between which the table has no node are mixed: as the light's side of a light path.
TEST(Measured, LightPathsSeeWhatCameraPathsSee) {
  const Tabulated table(lambert(16));
  Random random(4);
  for (int k = 0; k < 1000; ++k) {
    const Vec3<float> a = square_to_cosine_hemisphere(random.uniform(), random.uniform());
    const Vec3<float> b = square_to_cosine_hemisphere(random.uniform(), random.uniform());
    ASSERT_EQ(table.of.eval(a, b).f.y, table.of.eval(b, a, Mode::kImportance).f.y);
    const Vec3<float> below{-a.x, -a.y, -a.z}, other{-b.x, -b.y, -b.z};
    ASSERT_EQ(table.of.eval(a, b).f.y, table.of.eval(below, other).f.y);
    ASSERT_EQ(table.of.eval(a, other).f.y, 0.0f);
  }
}

// The share of the cosine keeps weights finite where a slice of the table is black.
TEST(Measured, BlackTablesReflectNothing) {
  TabulatedBrdf b = lambert(8);
  b.f = [](const Vec3d&, const Vec3d&) { return 0.0; };
  const Tabulated table(b);
  Random random(2);
  for (int k = 0; k < 1000; ++k) {
    const BsdfSample<float> s = table.of.sample(direction_at(50), random);
    if (s.valid) {
      ASSERT_EQ(s.weight.y, 0);
      ASSERT_GT(s.pdf, 0);
    }
  }
}

}  // namespace
}  // namespace lightmill::test
