// A room of instances -- mirrored, stretched, masked, bumpy, textured -- looks as it does flattened, to all
// three estimators. alpha = 1e-4 over the blocks of an image.
#include <gtest/gtest.h>

#include "tests/support/agreement.h"
#include "tests/support/instanced_scene.h"
#include "tests/support/scaled_scene.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill::test {
namespace {

Batches render(const SceneDescription& s, Integrator integrator, int64_t spp, uint64_t seed = 1) {
  Batches b = render_batches(s, settings_for(s, integrator, spp, 4, seed), 16);
  EXPECT_EQ(b.counters.nonfinite, 0u);
  return b;
}

TEST(InstancesAgreement, InstancedIsFlattenedIsEveryEstimator) {
  const SceneDescription room = room_of_instances().scene;
  ASSERT_EQ(build_scene(room).instance_count(), 9);
  const Batches pt = render(room, Integrator::kPt, 2048), bdpt = render(room, Integrator::kBdpt, 1024),
                lt = render(room, Integrator::kLt, 4096);
  EXPECT_TRUE(images_agree(pt, render(flattened(room), Integrator::kPt, 2048, 2)));
  EXPECT_TRUE(images_agree(bdpt, render(flattened(room), Integrator::kBdpt, 1024, 2)));
  EXPECT_TRUE(images_agree(pt, bdpt));
  EXPECT_TRUE(images_agree(lt, bdpt, {.max_excluded = 0.2}));
  EXPECT_FALSE(images_agree(lt, scaled(bdpt, 1.03f), {.max_excluded = 0.2}));
}

TEST(InstancesAgreement, TheObjectsAreSeen) {
  const SceneDescription room = room_of_instances().scene;
  SceneDescription other = room;
  for (InstanceDescription& i : other.instances) i.object_to_world.m[1][3] += 0.05;
  EXPECT_FALSE(images_agree(render(room, Integrator::kPt, 512), render(other, Integrator::kPt, 512)));
}

TEST(InstancesAgreement, ScalingTheRoomLeavesItsBitsAlone) {
  const SceneDescription room = room_of_instances().scene;
  for (const Integrator integrator : {Integrator::kPt, Integrator::kBdpt, Integrator::kLt}) {
    const auto bits = [&](const SceneDescription& s) {
      return render_batches(s, settings_for(s, integrator, 16, 4), 1).images[0].data;
    };
    const std::vector<float> original = bits(room);
    for (const int k : {-60, 13, 60}) {
      EXPECT_EQ(bits(scaled_scene(room, k)), original) << name_of(integrator) << ", 2^" << k;
      EXPECT_EQ(bits(scaled_vertices(room, k)), original) << name_of(integrator) << ", 2^" << k;
    }
  }
}

}  // namespace
}  // namespace lightmill::test
