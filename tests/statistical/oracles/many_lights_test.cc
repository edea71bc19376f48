// A thousand lights of every kind, near and far: pt, bdpt and lt agree, per channel and 8x8 block and over
// the image, with next-event estimation selecting by the light tree and light paths by power. alpha = 1e-4.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/agreement.h"
#include "tests/support/test_scene.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill::test {
namespace {

/// A floor and two walls under 1000 lights: lamps, bulbs, point lights and spots within and far above the
/// room; with `sky` a distant light and an environment too.
TestScene crowded_room(bool sky) {
  TestScene s;
  Random random(21);
  const int grey = s.diffuse(0.6f), red = s.diffuse(Rgb{0.7f, 0.2f, 0.1f}), black = s.diffuse(0);
  s.quad({-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, grey);
  s.quad({-2, 0, 2}, {0, 3, 0}, {4, 0, 0}, grey).quad({-2, 0, -2}, {0, 3, 0}, {0, 0, 4}, red);
  for (int i = 0; i < 1000; ++i) {
    const bool far = i % 8 == 7;
    const double reach = far ? 8 : 1.9;
    const Vec3d p{random.between(-reach, reach), far ? random.between(4, 9) : random.between(0.8, 2.5),
                  random.between(-reach, reach)};
    const auto level = static_cast<float>((far ? 6 : 0.3) * random.between(0.2, 2));
    const float area_level = level * 40;
    const Emits emits{{area_level, area_level, area_level / 2}, i % 3 == 0};
    if (i % 6 == 0) {
      s.point_light(p, {level * 0.1f, level * 0.1f, level * 0.1f});
    } else if (i % 6 == 1) {
      s.sphere(p, 0.03, black, emits);
    } else if (i % 6 == 2) {
      const double tilt = random.between(-0.5, 0.5), length = std::sqrt(1 + tilt * tilt);
      s.scene.lights.push_back(
          {SpotLight{{level * 0.4f, level * 0.4f, level * 0.4f}, p, {tilt / length, -1 / length, 0}, 20, 40},
           {}});
    } else {
      const double turn = random.between(0, 0.1);
      s.triangle(p, p + Vec3d{0.1, turn, 0}, p + Vec3d{0, turn, 0.1}, black, emits);
    }
  }
  if (sky) {
    s.environment({0.05f, 0.06f, 0.08f});
    LightDescription& sun = s.scene.lights.emplace_back();
    sun.kind = DistantLight{{0.3f, 0.3f, 0.3f}, {0.6, -0.8, 0}, 3};
  }
  s.camera({0.8, 0.7, -1.8}, {-0.2, 0.2, 1}, 60).film(16, 16);
  return s;
}

class ManyLights : public ::testing::TestWithParam<bool> {};

TEST_P(ManyLights, EstimatorsAgree) {
  const TestScene s = crowded_room(GetParam());
  ASSERT_FALSE(build_scene(s.scene).lights.tree.empty());
  const auto render = [&](Integrator integrator, int64_t spp) {
    Batches b = render_batches(s.scene, settings_for(s.scene, integrator, spp, 3, 5), 16);
    EXPECT_EQ(b.counters.nonfinite, 0u);
    return b;
  };
  const Batches pt = render(Integrator::kPt, 2048), bdpt = render(Integrator::kBdpt, 1024),
                lt = render(Integrator::kLt, 8192);
  const AgreementTest test{.max_relative_error = 0.05, .max_excluded = 0};
  EXPECT_TRUE(images_agree(pt, bdpt, test)) << "pt against bdpt";
  EXPECT_TRUE(images_agree(bdpt, lt, test)) << "bdpt against lt";
  EXPECT_TRUE(means_agree(pt.mean(), bdpt.mean(), {.resolution = 0.02}));
  EXPECT_TRUE(means_agree(lt.mean(), bdpt.mean(), {.resolution = 0.03}));
  EXPECT_FALSE(means_agree(pt.mean(), scaled(bdpt, 1.04f).mean(), {.resolution = 0.02}))
      << "the test notices nothing";
}

INSTANTIATE_TEST_SUITE_P(Sky, ManyLights, ::testing::Bool(),
                         [](const auto& info) { return info.param ? "open" : "closed"; });

}  // namespace
}  // namespace lightmill::test
