// Light paths learn where to go where that makes most of the noise, and nowhere else; the same on any number
// of threads.
#include "worker/render/guiding/training/emission_guide_training.h"

#include <gtest/gtest.h>

#include "tests/support/render.h"
#include "tests/support/test_scene.h"
#include "worker/render/light/light_sampling.h"
#include "worker/render/pipeline/context.h"
#include "worker/render/renderer.h"

namespace lightmill::test {
namespace {

/// A small lamp high over a floor, and a ball of glass beside it that throws a caustic onto a wall, which
/// fills the image. What does not go towards the ball adds little. The wall is of rough metal: a diffuse
/// one's camera paths would find the lamp by a photon guide.
TestScene far_caustic() {
  TestScene s;
  const int grey = s.diffuse(0.6f);
  s.quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, grey);
  s.quad({4, 0, -4}, {0, 0, 8}, {0, 4, 0}, s.conductor(0.6f, 0.7f));
  s.sphere({1.5, 2, 0}, 0.4, s.dielectric(1.5f, 0));
  s.quad({-2, 2, -0.02}, {0, 0, 0.04}, {0, -0.04, 0}, s.diffuse(0), {.radiance = {5000, 5000, 5000}});
  s.camera({0, 2, -1.5}, {4, 2, 0}, 30).film(64, 64);
  return s;
}

Renderer renderer_of(const TestScene& s, Integrator integrator = Integrator::kAuto, int threads = 1) {
  return {s.scene, settings_for(s.scene, integrator, 4, 5), threads};
}
const LightTable& lights_of(const Renderer& renderer) { return renderer.context().lights; }
double gain_of(const Renderer& renderer) { return renderer.context().scene.emission_guide_gain; }

TEST(EmissionGuideTraining, FindsWhatMakesACaustic) {
  const TestScene s = far_caustic();
  const Renderer renderer = renderer_of(s);
  const LightTable& lights = lights_of(renderer);
  EXPECT_GT(gain_of(renderer), 2);
  ASSERT_EQ(lights.emission_guide_of, (std::vector<int32_t>{0, 0})) << "both triangles by one table";
  // A third of the light paths at least start towards the ball, where a fiftieth would.
  const RenderScene& scene = renderer.context().scene;
  const Vec3d lamp = scene.normalised_point({-2, 2, 0}), ball = scene.normalised_point({1.5, 2, 0});
  const Vec3d to = normalized(ball - lamp);
  const double cos_edge = std::cos(std::asin(0.4 / 3.5));
  constexpr int kSamples = 20000;
  int hits = 0;
  for (int i = 0; i < kSamples; ++i) {
    const auto u = [&](uint32_t k) {
      return static_cast<float>(hash32(static_cast<uint32_t>(i) * 8 + k) >> 8) * 0x1p-24f;
    };
    const auto e = sample_emission<float>(lights, u(0), u(1), u(2), u(3), u(4), u(5));
    hits += dot(to, Vec3d{double{e.direction.x}, double{e.direction.y}, double{e.direction.z}}) > cos_edge;
  }
  EXPECT_GT(hits, kSamples / 3);
}

TEST(EmissionGuideTraining, FindsItFromAPointToo) {
  TestScene s = far_caustic();
  s.scene.shapes.pop_back();
  s.point_light({-2, 2, 0}, {20, 20, 20});
  const Renderer renderer = renderer_of(s);
  EXPECT_GT(gain_of(renderer), 2);
  EXPECT_EQ(lights_of(renderer).emission_guide_of, (std::vector<int32_t>{0}));
}

TEST(EmissionGuideTraining, DoesNotDependOnThreads) {
  const TestScene s = far_caustic();
  const Renderer one = renderer_of(s), three = renderer_of(s, Integrator::kAuto, 3);
  const LightTable &a = lights_of(one), &b = lights_of(three);
  EXPECT_EQ(gain_of(one), gain_of(three));
  EXPECT_EQ(a.emission_guide.share, b.emission_guide.share);
  EXPECT_EQ(a.records, b.records);
}

TEST(EmissionGuideTraining, ChoosesLightsThatMatter) {
  // A bright lamp in a box without a way out, beside a dim one that is all the light there is.
  TestScene s = far_caustic();
  s.box({-3.5, 0.5, 3}, {-2.5, 1.5, 3.8}, s.diffuse(0.5f));
  s.quad({-3.1, 1.2, 3.4}, {0.2, 0, 0}, {0, 0, 0.2}, s.diffuse(0), {.radiance = {500, 500, 500}});
  const Renderer renderer = renderer_of(s);
  const LightTable& lights = lights_of(renderer);
  ASSERT_EQ(lights.count(), 4);
  const auto slot = [&](size_t light, size_t k) { return lights.records[light * kLightFloats + k]; };
  EXPECT_GT(slot(2, kLightDirectSelect), 0.3f) << "next event goes by power as before";
  EXPECT_LT(slot(2, kLightSelect), 0.1f);
  EXPECT_GT(slot(2, kLightSelect), 0) << "it may yet matter";
  float sum = 0;
  for (size_t i = 0; i < 4; ++i) sum += slot(i, kLightSelect);
  EXPECT_NEAR(sum, 1, 1e-5);
}

TEST(EmissionGuideTraining, LeavesAloneWhatItCanNotHelp) {
  for (const Renderer& renderer :
       {renderer_of(cornell_room()), renderer_of(far_caustic(), Integrator::kPt)}) {
    const LightTable& lights = lights_of(renderer);
    EXPECT_FALSE(lights.has_emission_guide());
    EXPECT_FALSE(renderer.context().scene.guided_lights);
    EXPECT_EQ(lights.alias_keep, lights.direct_keep);
  }
  TestScene dark;
  dark.quad({-1, -1, -1}, {0, 0, 2}, {2, 0, 0}, dark.diffuse(0.5f));
  dark.camera({0, 1, -3}, {0, -1, 0}, 40).film(16, 16);
  EXPECT_FALSE(renderer_of(dark).context().scene.guided_lights);
}

}  // namespace
}  // namespace lightmill::test
