// Sets of kernels: who gets which, and that the image has the same bits under all that a scene can do with.
#include <gtest/gtest.h>

#include <functional>

#include "common/job/features.h"
#include "tests/support/render.h"
#include "tests/support/test_scene.h"
#include "worker/render/arithmetic_class.h"
#include "worker/render/diagnose/diagnosis.h"
#include "worker/render/renderer.h"

namespace lightmill::test {
namespace {

constexpr Integrator kIntegrators[] = {Integrator::kPt, Integrator::kLt, Integrator::kBdpt};

/// A diffuse room with balls in it, one of them a lamp, and too many for want of a tree.
TestScene balls() {
  TestScene s = cornell_room();
  const int grey = s.diffuse(0.6f);
  s.sphere({0.3, -0.7, 0.2}, 0.25, s.diffuse(Rgb{0.9f, 0.3f, 0.1f}));
  s.sphere({-0.4, 0.2, 0.1}, 0.15, grey, {.radiance = {3, 2, 1}});
  for (int i = 0; i < 150; ++i) {
    const double x = 0.12 * (i % 15) - 0.9, z = 0.15 * (i / 15) - 0.7;
    s.sphere({x, -0.95 + 0.01 * (i % 7), z}, 0.04, grey);
  }
  return s.film(40, 24);
}

void add_mesh_with_normals(TestScene* s) {
  auto mesh = std::make_shared<TriangleMesh>();
  mesh->positions = {{-0.5f, -0.5f, 0.3f}, {0.5f, -0.5f, 0.3f}, {0, 0.5f, 0.4f}};
  mesh->normals = {{0.6f, 0, -1}, {-0.5f, 0.3f, -1}, {0, 0.2f, -1}};
  mesh->triangles = {{0, 1, 2}};
  ShapeDescription& shape = s->scene.shapes.emplace_back();
  shape.kind = MeshShape{mesh};
  shape.material = 0;
}

/// Shading normals and a lens, and paths that escape through a room that is open to its back.
TestScene open_room() {
  TestScene s;
  const int grey = s.diffuse(0.5f);
  s.quad({-3, 0, -3}, {0, 0, 6}, {6, 0, 0}, grey).box({-0.5, 0, -0.5}, {0.5, 1, 0.5}, grey);
  s.quad({-1, 3, -1}, {2, 0, 0}, {0, 0, 2}, grey, {.radiance = {9, 8, 7}, .two_sided = true});
  add_mesh_with_normals(&s);
  s.camera({0, 3, -5}, {0, 0, 0}, 40).film(40, 24);
  s.scene.camera.lens_radius = 0.05;
  s.scene.camera.focal_distance = 5;
  return s;
}

RenderSettings settings_of(const TestScene& s, Integrator integrator, Features overrides) {
  RenderSettings settings = settings_for(s.scene, integrator, 4, 8);
  settings.overrides = overrides;
  return settings;
}
ScenePlan plan_for(const TestScene& s, Features overrides = 0) {
  return Renderer(s.scene, settings_of(s, Integrator::kPt, overrides), 1).plan();
}
PlanItem general_kernels(const ScenePlan& plan) {
  for (const PlanItem& item : plan.items) {
    if (item.feature_bit == kGeneralKernels) return item;
  }
  ADD_FAILURE() << "the item is missing";
  return {};
}

void expect_the_bits_of_general_kernels(const TestScene& s) {
  for (const Integrator integrator : kIntegrators) {
    const Partial diffuse = render_partial(s.scene, settings_of(s, integrator, 0)),
                  general = render_partial(s.scene, settings_of(s, integrator, kGeneralKernels));
    EXPECT_TRUE(diffuse.camera == general.camera && diffuse.splats == general.splats) << name_of(integrator);
    EXPECT_EQ(diffuse.counters.shadow_rays, general.counters.shadow_rays);
    EXPECT_EQ(diffuse.counters.zero_connections_skipped, general.counters.zero_connections_skipped);
    EXPECT_EQ(diffuse.counters.rouletted_connections, general.counters.rouletted_connections);
    EXPECT_EQ(diffuse.counters.closest_hit_rays, general.counters.closest_hit_rays);
  }
}

TEST(KernelSets, OfDiffuseSurfacesRenderTheSameBits) {
  for (const TestScene& s : {cornell_room().film(40, 24), balls(), open_room()}) {
    ASSERT_EQ(plan_for(s).kernels.paths, KernelSet::kDiffuse);
    ASSERT_EQ(plan_for(s, kGeneralKernels).kernels.paths, KernelSet::kSurfaces);
    expect_the_bits_of_general_kernels(s);
  }
}

/// Diffuse things, some textured and mixed, beside a mirror and glass: nothing else is ever joined.
TestScene mirrors() {
  TestScene s = cornell_room();
  s.sphere({0.4, -0.6, 0.2}, 0.3, s.conductor(0.9f, 0))
      .sphere({-0.4, -0.6, -0.1}, 0.3, s.dielectric(1.5f, 0));
  s.sphere({0, 0.2, 0.3}, 0.2, s.mix(s.diffuse(0.2f), s.conductor(0.8f, 0), 0.5f));
  const CheckerboardTexture board{{{0.8f, 0.3f, 0.2f}, -1}, {{0.2f, 0.4f, 0.7f}, -1}, {4, 4, 0, 0}};
  s.scene.textures.push_back({"board", true, board, {}});
  s.scene.materials.front().kind = DiffuseMaterial{{{1, 1, 1}, 0}};
  add_mesh_with_normals(&s);
  return s.film(40, 24);
}

TEST(KernelSets, DiffuseKernelsJoinWhatGeneralOnesFollow) {
  TestScene sky = mirrors();
  sky.environment({1, 1, 1});
  for (const TestScene& s : {mirrors(), sky}) {
    const StageKernels kernels = plan_for(s).kernels, all = plan_for(s, kGeneralKernels).kernels;
    EXPECT_EQ(kernels.paths, KernelSet::kSurfaces);
    EXPECT_EQ(kernels.next_event, s.scene.lights.empty() ? KernelSet::kDiffuse : KernelSet::kSurfaces);
    EXPECT_EQ(kernels.joins, KernelSet::kDiffuse);
    EXPECT_EQ(all.joins, KernelSet::kSurfaces);
    EXPECT_EQ(all.next_event, KernelSet::kSurfaces);
    expect_the_bits_of_general_kernels(s);
  }
  // Anything that can be joined and is not diffuse needs general kernels there.
  for (const auto& material : std::vector<std::function<int(TestScene*)>>{
           [](TestScene* s) { return s->conductor(0.9f, 0.2f); },
           [](TestScene* s) { return s->dielectric(1.5f, 0.3f); },
           [](TestScene* s) {
             return s->coated({0.5f, 0.5f, 0.5f}, 1.5f, 0);
           },
           [](TestScene* s) { return s->mix(0, s->conductor(0.9f, 0.2f), 0.5f); },
       }) {
    TestScene s = mirrors();
    s.sphere({0, 0, 0}, 0.1, material(&s));
    EXPECT_EQ(plan_for(s).kernels.joins, KernelSet::kSurfaces);
    EXPECT_EQ(plan_for(s).kernels.next_event, KernelSet::kSurfaces);
  }
}

// A recorder needs kernels that tell it what they do.
TEST(KernelSets, WhoLooksOnSeesTheSameImage) {
  const TestScene s = cornell_room().film(40, 24);
  const RenderSettings settings = settings_of(s, Integrator::kBdpt, 0);
  const Diagnosis watched = diagnose(s.scene, settings, 1, [] { return true; });
  const Partial alone = render_partial(s.scene, settings);
  EXPECT_EQ(watched.counters.shadow_rays, alone.counters.shadow_rays);
  EXPECT_EQ(watched.counters.zero_connections_skipped, alone.counters.zero_connections_skipped);
  EXPECT_EQ(watched.counters.closest_hit_rays, alone.counters.closest_hit_rays);
}

TEST(KernelSets, ThePlanSaysWhy) {
  const PlanItem left_out = general_kernels(plan_for(cornell_room()));
  EXPECT_FALSE(left_out.needed);
  EXPECT_EQ(left_out.reason, "every surface is diffuse and of one colour, and a few of them give the light");
  EXPECT_NE(left_out.saving, "");
  const PlanItem kept = general_kernels(plan_for(cornell_room(), kGeneralKernels));
  EXPECT_TRUE(kept.needed);
  EXPECT_EQ(kept.reason, "kept by --plan-override");
}

/// The room after `change`, and why it needs general kernels.
std::string reason_after(const std::function<void(TestScene*)>& change,
                         KernelSet expected = KernelSet::kSurfaces) {
  TestScene s = cornell_room();
  change(&s);
  const ScenePlan plan = plan_for(s);
  EXPECT_EQ(plan.kernels.paths, expected);
  EXPECT_EQ(general_kernels(plan).needed, expected != KernelSet::kDiffuse);
  return general_kernels(plan).reason;
}

TEST(KernelSets, DiffuseKernelsAreForDiffuseScenesAlone) {
  for (const auto& material : std::vector<std::function<int(TestScene*)>>{
           [](TestScene* s) { return s->conductor(0.9f, 0.2f); },
           [](TestScene* s) { return s->conductor(0.9f, 0); },
           [](TestScene* s) { return s->dielectric(1.5f, 0); },
           [](TestScene* s) {
             return s->coated({0.5f, 0.5f, 0.5f}, 1.5f, 0.1f);
           },
           [](TestScene* s) {
             return s->diffuse_transmission({0.4f, 0.4f, 0.4f}, {0.4f, 0.4f, 0.4f});
           },
           [](TestScene* s) { return s->mix(0, s->diffuse(0.2f), 0.5f); },
       }) {
    const std::string reason = reason_after([&](TestScene* s) { s->sphere({0, 0, 0}, 0.1, material(s)); });
    EXPECT_TRUE(reason.starts_with("a material in use is not diffuse")) << reason;
    // A material that nothing is made of needs nothing.
    reason_after([&](TestScene* s) { material(s); }, KernelSet::kDiffuse);
  }
  for (const auto& light : std::vector<std::function<void(TestScene*)>>{
           [](TestScene* s) {
             s->point_light({0, 0, 0}, {1, 1, 1});
           },
           [](TestScene* s) {
             s->environment({1, 1, 1});
           },
           [](TestScene* s) {
             s->scene.lights.push_back({DistantLight{{0.4f, 0.3f, 0.2f}, {0, -0.6, 0.8}}, {}});
           },
       }) {
    EXPECT_EQ(reason_after(light),
              "a light has no surface; but vertices that are joined are diffuse, and those kernels are, too");
  }
  EXPECT_EQ(reason_after([](TestScene* s) {
              for (int i = 0; i < 20; ++i)
                s->sphere({0.05 * i - 0.5, 0, 0}, 0.01, 0, {.radiance = {1, 1, 1}});
            }),
            "lights are many; but vertices that are joined are diffuse, and those kernels are, too");
  EXPECT_EQ(
      reason_after([](TestScene* s) {
        const CheckerboardTexture board{{{0.8f, 0.3f, 0.2f}, -1}, {{0.2f, 0.4f, 0.7f}, -1}, {4, 4, 0, 0}};
        s->scene.textures.push_back({"board", true, board, {}});
        s->scene.materials.front().kind = DiffuseMaterial{{{1, 1, 1}, 0}};
      }),
      "a colour or a normal map varies over a surface; but all that is joined is diffuse, and those kernels "
      "are, too");
  EXPECT_EQ(reason_after(
                [](TestScene* s) {
                  s->scene.media = {{"", {0.1f, 0.1f, 0.1f}, {0.1f, 0.1f, 0.1f}, {}, 0, {}}};
                  for (ShapeDescription& shape : s->scene.shapes) shape.media = {0, 0};
                  s->scene.camera.medium = 0;
                },
                KernelSet::kMedia),
            "there are media");
}

TEST(KernelSets, OtherOverridesThatNeedThemBringGeneralKernels) {
  for (const Features bit : {kTextures, kBumps, kAnisotropicLobes, kMixes, kMaterialSort, kDeltaLights})
    EXPECT_EQ(plan_for(cornell_room(), bit).kernels.paths, KernelSet::kSurfaces) << feature_names(bit);
  for (const Features bit : {kAlphaMasks, kShadingNormals, kVertexConnections})
    EXPECT_EQ(plan_for(cornell_room(), bit).kernels.paths, KernelSet::kDiffuse) << feature_names(bit);
}

// Its scenes are of every kernel, and must all render.
TEST(ArithmeticClass, IsADigest) { EXPECT_EQ(arithmetic_class().size(), 64u); }

}  // namespace
}  // namespace lightmill::test
