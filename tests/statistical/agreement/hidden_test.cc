// Lamps and what is hidden from the camera: every set of strategies gives the same image, and it is that of
// the same scene made otherwise.
//
// Confidence as in strategies_test.cc.
#include <gtest/gtest.h>

#include "tests/statistical/agreement/strategy_set.h"

namespace lightmill::test {
namespace {

/// A floor with a rough metal ball, and a block before it that the camera does not see.
TestScene stage() {
  TestScene s;
  s.quad({-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, s.diffuse({0.6f, 0.5f, 0.3f}));
  s.sphere({0.5, 0.5, 0.2}, 0.5, s.conductor(0.8f, 0.4f));
  s.box({-0.9, 0.01, -0.9}, {-0.3, 0.7, -0.3}, s.diffuse({0.3f, 0.6f, 0.8f}));
  s.scene.shapes.back().hidden = kCameraRays;
  s.camera({0, 1.5, -3}, {0, 0.3, 0}, 50).film(16, 16);
  return s;
}
void add_lamp(TestScene* s, LightKind light) {
  s->scene.lights.push_back({std::move(light), {}});
  s->scene.lights.back().hidden = kCameraRays;
}
Transform shining_down(const Vec3d& at) { return translation(at) * rotation(-90, {1, 0, 0}); }

class HiddenSets : public ::testing::TestWithParam<unsigned> {};

TEST_P(HiddenSets, AgreeUnderAnAreaLamp) {
  TestScene s = stage();
  add_lamp(&s, AreaLamp{{4, 3, 2}, shining_down({-0.2, 1.6, -0.3}), 0.6, 0.4, true});
  expect_agrees_with_all(s, GetParam(), {.max_depth = 4});
}

TEST_P(HiddenSets, AgreeUnderALampWithASpread) {
  TestScene s = stage();
  add_lamp(&s, AreaLamp{{4, 3, 2}, shining_down({-0.2, 1.6, -0.3}), 0.6, 0.4, false, 100});
  expect_agrees_with_all(s, GetParam(), {.max_depth = 3});
}

TEST_P(HiddenSets, AgreeUnderALampThatFacesThem) {
  TestScene s = stage();
  add_lamp(&s, PointLight{{3, 2.5f, 2}, {-0.4, 1.1, -0.5}, 0.4});
  expect_agrees_with_all(s, GetParam(), {.max_depth = 4});
}

TEST_P(HiddenSets, AgreeUnderASoftSpot) {
  TestScene s = stage();
  SpotLight spot{{6, 5, 4}, {-0.4, 1.6, -0.6}, normalized({0.2, -1, 0.3}), 10, 60};
  spot.falls_as_cosine = true;
  spot.radius = 0.3;
  add_lamp(&s, spot);
  expect_agrees_with_all(s, GetParam(), {.max_depth = 3});
}

TEST_P(HiddenSets, AgreeUnderAnEmitterThatTheCameraDoesNotSee) {
  TestScene s = stage();
  s.quad({-0.7, 1.2, -0.5}, {1, 0, 0}, {0, 0, 0.6}, s.diffuse(0.2f), {.radiance = {5, 4, 3}});
  s.scene.shapes.back().hidden = kCameraRays;
  expect_agrees_with_all(s, GetParam(), {.max_depth = 3});
}

INSTANTIATE_TEST_SUITE_P(All, HiddenSets, ::testing::Values(3u, 7u, 11u, 15u), set_name);

// The camera sees the background alone, and all else the sky.
TEST(HiddenTest, ABackgroundGivesNoLight) {
  TestScene s = stage();
  add_lamp(&s, InfiniteLight{{1, 1.2f, 1.5f}});
  TestScene with_background = s;
  with_background.scene.lights.push_back({InfiniteLight{{5, 0, 0}}, {}});
  with_background.scene.lights.back().hidden = kScatteredRays | kShadowRays;
  const auto render = [](const TestScene& scene, Integrator integrator, uint64_t seed) {
    return render_batches(scene.scene, settings_for(scene.scene, integrator, 256, 3, seed), 16);
  };
  const Batches pt = render(with_background, Integrator::kPt, 1),
                bdpt = render(with_background, Integrator::kBdpt, 2), without = render(s, Integrator::kPt, 3);
  EXPECT_TRUE(images_agree(pt, bdpt));
  const std::vector<float>& pixels = pt.images.front().data;
  float reddest = 0;
  for (size_t i = 0; i < pixels.size(); i += 3) reddest = std::max(reddest, pixels[i]);
  EXPECT_NEAR(reddest, 5, 1e-3) << "it is seen";
  // It is red alone, and so is all light that it would give.
  const Estimate blue = pt.mean(2), without_it = without.mean(2);
  EXPECT_NEAR(blue.mean, without_it.mean, 5 * (blue.standard_error + without_it.standard_error));
  const double red = pt.mean(0).mean - without.mean(0).mean;
  EXPECT_LT(red, 5 * 0.6) << "at most where nothing else is seen";
}

// A Principled BSDF's diffuse lobes do not see what is hidden from diffuse rays, its specular ones do: what
// the two see of a sky makes up the whole, and each is that of a material without the other lobes.
TEST(HiddenTest, RaysAreOfTheKindOfTheirLobe) {
  constexpr int64_t kSpp = 1024;
  const auto image = [](const PrincipledMaterial& m, RayKinds hidden, uint64_t seed) {
    TestScene s;
    s.scene.materials.emplace_back().kind = m;
    const int material = static_cast<int>(s.scene.materials.size()) - 1;
    s.quad({-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, material).sphere({0, 0.5, 0.2}, 0.5, material);
    add_lamp(&s, InfiniteLight{{1, 1.2f, 1.5f}});
    s.scene.lights.back().hidden = static_cast<RayKinds>(kCameraRays | hidden);
    s.camera({0, 1.5, -3}, {0, 0.3, 0}, 50).film(16, 16);
    return render_batches(s.scene, settings_for(s.scene, Integrator::kPt, kSpp, 1, seed), 16).mean();
  };
  PrincipledMaterial m;
  m.base_color.value = {0.5f, 0.3f, 0.2f};
  m.specular.value = 0.8f, m.clearcoat.value = 1, m.roughness.value = 0.3f, m.sheen.value = 0.5f;
  const auto near = [](const Estimate& a, double b, double b_error) {
    EXPECT_NEAR(a.mean, b, 5 * (a.standard_error + b_error));
    EXPECT_LT(a.standard_error + b_error, 0.01 * b);
  };
  const Estimate whole = image(m, 0, 1), of_glossy = image(m, kDiffuseRays, 2),
                 of_diffuse = image(m, kGlossyRays, 3);
  near(whole, of_glossy.mean + of_diffuse.mean, of_glossy.standard_error + of_diffuse.standard_error);
  PrincipledMaterial matte = m;
  matte.specular.value = matte.clearcoat.value = 0;
  const Estimate diffuse = image(matte, 0, 4);
  near(of_diffuse, diffuse.mean, diffuse.standard_error);
  EXPECT_GT(of_glossy.mean, 0.05 * whole.mean);
}

}  // namespace
}  // namespace lightmill::test
