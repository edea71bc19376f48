// Anisotropic metal and glass under a lamp and a sky: pt and bdpt agree, 16 batches a side, alpha = 1e-4 over
// all blocks; the comparison must fail when scaled by 1.05. Brushed across, the highlight must lie otherwise.
#include <gtest/gtest.h>

#include "tests/support/agreement.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

constexpr int kBrushedBatches = 16;

TestScene brushed(float u, float v) {
  TestScene s;
  const Roughness roughness{{u, -1}, {v, -1}, false};
  const int metal = s.conductor(0.9f, 0.2f), glass = s.dielectric(1.5f, 0.2f);
  std::get<ConductorMaterial>(s.scene.materials[static_cast<size_t>(metal)].kind).roughness = roughness;
  std::get<DielectricMaterial>(s.scene.materials[static_cast<size_t>(glass)].kind).roughness = roughness;
  s.quad({-4, -1, -4}, {0, 0, 8}, {8, 0, 0}, metal);
  s.sphere({-1.1, 0, 0}, 1, metal).sphere({1.1, 0, 0}, 1, glass);
  s.sphere({0, 4, 2}, 0.7, s.diffuse(0), {.radiance = {20, 18, 15}});
  s.environment({0.1f, 0.12f, 0.15f});
  s.camera({0, 3, -5}, {0, 0, 0}, 40).film(32, 24);
  return s;
}

TEST(Brushed, PathAndBidirectionalAgree) {
  const TestScene s = brushed(0.5f, 0.15f);
  const Batches pt =
      render_batches(s.scene, settings_for(s.scene, Integrator::kPt, 1024, 4), kBrushedBatches);
  const Batches bdpt =
      render_batches(s.scene, settings_for(s.scene, Integrator::kBdpt, 512, 4, 2), kBrushedBatches);
  EXPECT_EQ(pt.counters.nonfinite + bdpt.counters.nonfinite, 0u);
  EXPECT_TRUE(images_agree(pt, bdpt));
  EXPECT_FALSE(images_agree(pt, scaled(bdpt, 1.05f))) << "the test notices nothing";
}

TEST(Brushed, TheDirectionShows) {
  const TestScene along = brushed(0.5f, 0.05f), across = brushed(0.05f, 0.5f);
  const Batches a =
      render_batches(along.scene, settings_for(along.scene, Integrator::kPt, 512, 4), kBrushedBatches);
  const Batches b =
      render_batches(across.scene, settings_for(across.scene, Integrator::kPt, 512, 4), kBrushedBatches);
  EXPECT_FALSE(images_agree(a, b));
}

}  // namespace
}  // namespace lightmill::test
