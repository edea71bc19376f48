// Measured BRDFs in renders: pt, lt and bdpt agree, 16 batches a side, alpha = 1e-4 over all blocks, and the
// comparison must fail when scaled by 1.05; a table of a constant renders as diffuse.
#include <gtest/gtest.h>

#include "tests/support/agreement.h"
#include "tests/support/measured_file.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

constexpr int kMeasuredBatches = 16;

int add(TestScene& s, const TabulatedBrdf& brdf) {
  s.scene.materials.push_back({"", measured_material(brdf), {}});
  return static_cast<int>(s.scene.materials.size()) - 1;
}

TabulatedBrdf brdf(double alpha_x, double alpha_y, int azimuths) {
  TabulatedBrdf b;
  b.f = ggx_brdf(alpha_x, alpha_y);
  b.alpha = 0.5;
  b.azimuths = azimuths;
  b.facets = b.warped = 16;
  b.spectrum = {{400, 0.4}, {560, 0.7}, {650, 0.9}};
  return b;
}

// Coarse tables, which are far from reciprocal.
TEST(MeasuredScenes, StrategiesAgree) {
  TestScene s;
  const int even = add(s, brdf(0.5, 0.5, 1)), brushed = add(s, brdf(0.7, 0.35, 9));
  s.quad({-3, -1, -3}, {0, 0, 6}, {6, 0, 0}, even);
  s.sphere({-1.1, 0, 0}, 1, even).sphere({1.1, 0, 0}, 1, brushed);
  s.quad({-1.5, 3, -0.5}, {3, 0, 0}, {0, 0, 3}, s.diffuse(0), {.radiance = {12, 11, 10}});
  s.camera({0, 3, -5}, {0, 0, 0}, 40).film(24, 16);
  const Batches pt =
      render_batches(s.scene, settings_for(s.scene, Integrator::kPt, 768, 4), kMeasuredBatches);
  const Batches bdpt =
      render_batches(s.scene, settings_for(s.scene, Integrator::kBdpt, 256, 4, 2), kMeasuredBatches);
  const Batches lt =
      render_batches(s.scene, settings_for(s.scene, Integrator::kLt, 768, 4, 3), kMeasuredBatches);
  EXPECT_EQ(pt.counters.nonfinite + bdpt.counters.nonfinite + lt.counters.nonfinite, 0u);
  EXPECT_TRUE(images_agree(pt, bdpt));
  EXPECT_FALSE(images_agree(pt, scaled(bdpt, 1.05f))) << "the test notices nothing";
  EXPECT_TRUE(images_agree(pt, lt));
}

// A grey table in a white furnace: every pixel of the ball has the albedo; the picture is that of a diffuse
// ball within the table's resolution.
TEST(MeasuredScenes, AConstantTableIsADiffuseBall) {
  const auto mean = [](bool tabulated) {
    TestScene s;
    TabulatedBrdf constant;
    constant.f = [](const Vec3d&, const Vec3d&) { return 0.6 / M_PI; };
    constant.facets = constant.warped = 48;
    constant.zeniths = 24;
    s.sphere({0, 0, 0}, 1, tabulated ? add(s, constant) : s.diffuse(0.6f));
    s.environment({1, 1, 1}).camera({0, 0, -3}, {0, 0, 0}, 25).film(16, 16);
    const Batches b =
        render_batches(s.scene, settings_for(s.scene, Integrator::kPt, 256, 4), kMeasuredBatches);
    EXPECT_EQ(b.counters.nonfinite, 0u);
    return b.mean(1);
  };
  const Estimate diffuse = mean(false);
  EXPECT_TRUE(mean_is(mean(true), diffuse.mean, {.resolution = 0.01, .rounding = 0.006}));
}

}  // namespace
}  // namespace lightmill::test
