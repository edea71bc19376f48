// pt, bdpt and lt agree where normal maps tilt the shading normals: the adjoint correction
// holds for them too.
#include <gtest/gtest.h>

#include "tests/support/agreement.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

Batches render(const TestScene& s, Integrator integrator, int64_t spp) {
  Batches b = render_batches(s.scene, settings_for(s.scene, integrator, spp, 4), 16);
  EXPECT_EQ(b.counters.nonfinite, 0u);
  return b;
}

/// The room with a checkerboard of two tilts on all its white surfaces and a bumpy metal ball.
TestScene bumpy_room() {
  TestScene s = cornell_room();
  const Rgb left{0.3f, 0.55f, 0.95f}, right{0.65f, 0.4f, 0.9f};
  s.scene.textures.push_back({"tilts", true, CheckerboardTexture{{left, -1}, {right, -1}, {5, 5, 0, 0}}, {}});
  s.scene.materials[0].normal_map = 0;  // the room's white
  const int metal = s.conductor(0.8f, 0.4f);
  s.scene.materials.back().normal_map = 0;
  s.sphere({-0.5, -0.6, 0.4}, 0.35, metal);
  return s;
}

TEST(BumpAgreement, EstimatorsAgreeOnTiltedNormals) {
  const TestScene s = bumpy_room();
  const Batches pt = render(s, Integrator::kPt, 2048), bdpt = render(s, Integrator::kBdpt, 1024),
                lt = render(s, Integrator::kLt, 4096);
  EXPECT_TRUE(images_agree(pt, bdpt));
  EXPECT_TRUE(images_agree(lt, bdpt, {.max_excluded = 0.2}));
  EXPECT_FALSE(images_agree(lt, scaled(bdpt, 1.03f), {.max_excluded = 0.2}));
}

// Without the map the picture is another one: the test above sees the tilts.
TEST(BumpAgreement, TiltsChangeThePicture) {
  const TestScene bumpy = bumpy_room();
  TestScene flat = bumpy;
  for (MaterialDescription& m : flat.scene.materials) m.normal_map = -1;
  EXPECT_FALSE(images_agree(render(bumpy, Integrator::kPt, 1024), render(flat, Integrator::kPt, 1024)));
}

}  // namespace
}  // namespace lightmill::test
