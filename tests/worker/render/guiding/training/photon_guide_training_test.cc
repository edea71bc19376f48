// A photon guide is made where camera paths are led to lights that they would hardly meet, and nowhere else;
// it is the same on any number of threads.
#include "worker/render/guiding/training/photon_guide_training.h"

#include <gtest/gtest.h>

#include "tests/support/render.h"
#include "tests/support/test_scene.h"
#include "worker/render/pipeline/context.h"
#include "worker/render/renderer.h"

namespace lightmill::test {
namespace {

/// A floor and a lamp that a screen hides from it; a mirror behind the floor shows the lamp. `half`: of the
/// lamp's side.
TestScene lamp_in_a_mirror(double half) {
  TestScene s;
  const float radiance = static_cast<float>(1 / (half * half));
  s.quad({-1, 0, 0}, {0, 0, 1}, {2, 0, 0}, s.diffuse(0.6f));
  s.quad({-1, 0, 1.5}, {0, 2, 0}, {2, 0, 0}, s.conductor(0.9f, 0));
  s.quad({-1, 0.8, 0}, {0, 0, 1}, {2, 0, 0}, s.diffuse(0));
  s.quad({-half, 1.5 - half, 0.5}, {2 * half, 0, 0}, {0, 2 * half, 0}, s.diffuse(0),
         {.radiance = {radiance, radiance, radiance}});
  s.camera({0, 0.6, -1}, {0, 0, 0.5}, 40).film(48, 48);
  return s;
}

Renderer renderer_with_photons(const TestScene& s, Integrator integrator = Integrator::kAuto,
                               int threads = 1) {
  return {s.scene, settings_for(s.scene, integrator, 4, 5), threads};
}
const PhotonGuide& guide_of(const Renderer& renderer) { return renderer.context().scene.caustics; }

TEST(CausticLearning, FindsALampInAMirror) {
  for (const Integrator integrator : {Integrator::kAuto, Integrator::kPt}) {
    const Renderer renderer = renderer_with_photons(lamp_in_a_mirror(0.05), integrator);
    const PhotonGuide& guide = guide_of(renderer);
    ASSERT_FALSE(guide.empty()) << name_of(integrator);
    if (integrator == Integrator::kPt) {
      EXPECT_GT(guide.gain, 10);
    }
    // From the middle of the floor paths go to the lamp's image.
    const RenderScene& scene = renderer.context().scene;
    const Vec3d at = scene.normalised_point({0, 0, 0.5}), image = scene.normalised_point({0, 1.5, 2.5});
    const Vec3<float> p{static_cast<float>(at.x), static_cast<float>(at.y), static_cast<float>(at.z)};
    const PhotonGuideTables<float> tables(guide, true, kDiffuse, p);
    ASSERT_TRUE(tables.mask);
    const Vec3d to = normalized(image - at);
    int close = 0;
    for (int i = 0; i < 1000; ++i) {
      const Vec3<float> w = tables.draw((static_cast<float>(i) + 0.5f) / 1000,
                                        static_cast<float>(hash32(static_cast<uint32_t>(i)) >> 8) * 0x1p-24f);
      close += dot(to, Vec3d{double{w.x}, double{w.y}, double{w.z}}) > std::cos(0.1);
    }
    EXPECT_GT(close, 800);
  }
}

TEST(CausticLearning, DoesNotDependOnThreads) {
  const TestScene s = lamp_in_a_mirror(0.05);
  const Renderer one = renderer_with_photons(s), three = renderer_with_photons(s, Integrator::kAuto, 3);
  const PhotonGuide &a = guide_of(one), &b = guide_of(three);
  EXPECT_EQ(a.gain, b.gain);
  EXPECT_EQ(a.share, b.share);
  EXPECT_EQ(a.table_of, b.table_of);
  EXPECT_EQ(a.tables, b.tables);
}

TEST(CausticLearning, LeavesAloneWhatItCanNotHelp) {
  EXPECT_TRUE(guide_of(renderer_with_photons(cornell_room())).empty()) << "no glass and no mirror";
  TestScene point = lamp_in_a_mirror(0.05);
  point.scene.shapes.pop_back();
  point.point_light({0, 1.5, 0.5}, {1, 1, 1});
  EXPECT_TRUE(guide_of(renderer_with_photons(point)).empty()) << "nothing hits a point";
  TestScene dark = lamp_in_a_mirror(0.05);
  dark.scene.shapes.pop_back();
  EXPECT_TRUE(guide_of(renderer_with_photons(dark)).empty());
  // A lamp so small that paths which are led to it miss it all the same: fireflies in place of a dark spot.
  TestScene tiny = lamp_in_a_mirror(1e-5);
  EXPECT_TRUE(guide_of(renderer_with_photons(tiny)).empty());
}

}  // namespace
}  // namespace lightmill::test
