// glTF's materials under a lamp and a sky: pt, bdpt and lt agree, 16 batches a side, alpha = 1e-4 over all
// blocks; the comparison must fail when scaled by 1.05. A white furnace stays white. All shared scenes
// render.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "common/scene/load.h"
#include "tests/support/agreement.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

constexpr int kGltfAgreementBatches = 16;

int add(TestScene& s, MaterialKind kind) {
  s.scene.materials.push_back({"", std::move(kind), {}});
  return static_cast<int>(s.scene.materials.size()) - 1;
}

MetallicRoughnessMaterial metallic(const Rgb& base, float metal, float roughness) {
  MetallicRoughnessMaterial m;
  m.base_color.value = base;
  m.metallic.value = metal;
  m.roughness.value = roughness;
  return m;
}

TestScene balls() {
  TestScene s;
  MetallicRoughnessMaterial coated = metallic({0.7f, 0.2f, 0.1f}, 0, 0.7f);
  coated.clearcoat.value = 0.8f;
  coated.clearcoat_roughness.value = 0.5f;
  const Rgb tint{0.6f, 0.9f, 0.7f};
  const int sheet = add(s, TransmissionMaterial{{tint, -1}, {0.6f, -1}, 1.5f, true});
  const int glass = add(s, TransmissionMaterial{{tint, -1}, {0.6f, -1}, 1.4f, false});
  const int plastic = add(s, metallic({0.2f, 0.4f, 0.8f}, 0, 0.6f));
  s.quad({-4, -1, -4}, {0, 0, 8}, {8, 0, 0}, add(s, metallic({0.6f, 0.6f, 0.6f}, 0.3f, 0.7f)));
  s.sphere({-2.2, 0, 0}, 0.9, add(s, coated)).sphere({0, 0, 0}, 0.9, glass);
  s.sphere({2.2, 0, 0}, 0.9, add(s, metallic({0.9f, 0.7f, 0.3f}, 1, 0.5f)));
  s.sphere({-1.1, 0.2, -1.6}, 0.5, s.mix(plastic, sheet, 0.5f));
  MetallicRoughnessMaterial velvet = metallic({0.4f, 0.1f, 0.1f}, 0, 0.8f);
  velvet.sheen_color.value = {0.9f, 0.5f, 0.6f};
  velvet.sheen_roughness.value = 0.5f;
  s.sphere({1.2, 0.2, -1.6}, 0.5, add(s, velvet));
  MetallicRoughnessMaterial soapy = metallic({0.5f, 0.5f, 0.5f}, 0.4f, 0.6f);
  soapy.iridescence.value = 0.9f;
  soapy.iridescence_ior = 1.8f;
  s.sphere({0, 0.1, -2.4}, 0.4, add(s, soapy));
  MetallicRoughnessMaterial scratched = metallic({0.7f, 0.6f, 0.5f}, 0.8f, 0.6f);
  scratched.anisotropy = 0.8f;
  scratched.anisotropy_rotation = 0.1f;
  s.sphere({-2.2, 0.3, -1.8}, 0.4, add(s, scratched));
  MetallicRoughnessMaterial leaf = metallic({0.3f, 0.5f, 0.2f}, 0, 0.6f);
  leaf.translucence.value = 0.7f;
  leaf.translucent_color.value = {0.5f, 0.8f, 0.2f};
  s.sphere({2.4, 0.3, -1.8}, 0.4, add(s, leaf));
  s.sphere({0, 4, 2}, 0.9, s.diffuse(0), {.radiance = {20, 18, 15}});
  s.environment({0.1f, 0.12f, 0.15f});
  s.camera({0, 3, -6}, {0, 0, 0}, 40).film(32, 24);
  return s;
}

TEST(GltfMaterials, TheIntegratorsAgree) {
  const TestScene s = balls();
  const auto render = [&](Integrator integrator, int64_t spp, uint64_t seed) {
    return render_batches(s.scene, settings_for(s.scene, integrator, spp, 4, seed), kGltfAgreementBatches);
  };
  const Batches pt = render(Integrator::kPt, 1024, 1), bdpt = render(Integrator::kBdpt, 512, 2);
  EXPECT_EQ(pt.counters.nonfinite + bdpt.counters.nonfinite, 0u);
  EXPECT_TRUE(images_agree(pt, bdpt));
  EXPECT_FALSE(images_agree(pt, scaled(bdpt, 1.05f))) << "the test notices nothing";
}

// Without the sky and at one scattering event, so that light tracing sees what the others see.
TEST(GltfMaterials, LightTracingAgrees) {
  TestScene s = balls();
  s.scene.lights.clear();
  const auto render = [&](Integrator integrator, int64_t spp, uint64_t seed) {
    return render_batches(s.scene, settings_for(s.scene, integrator, spp, 2, seed), kGltfAgreementBatches);
  };
  const Batches pt = render(Integrator::kPt, 1024, 1), lt = render(Integrator::kLt, 2048, 2);
  AgreementTest test;
  test.max_excluded = 0.4;  // of blocks that see nothing of the lamp
  EXPECT_TRUE(images_agree(pt, lt, test));
  EXPECT_FALSE(images_agree(pt, scaled(lt, 1.1f), test)) << "the test notices nothing";
}

TEST(GltfMaterials, AWhiteFurnaceStaysWhite) {
  for (const float metal : {0.0f, 1.0f}) {
    for (const float roughness : {0.3f, 0.6f, 0.85f, 1.0f}) {
      TestScene s;
      s.sphere({0, 0, 4}, 1, add(s, metallic({1, 1, 1}, metal, roughness)));
      s.environment({1, 1, 1});
      s.camera({0, 0, 0}, {0, 0, 4}, 30).film(16, 16);
      const Batches images =
          render_batches(s.scene, settings_for(s.scene, Integrator::kPt, 512, 8), kGltfAgreementBatches);
      const Estimate mean = images.mean();
      EXPECT_NEAR(mean.mean, 1, 0.01 + 4 * mean.standard_error) << metal << " " << roughness;
    }
  }
}

TEST(GltfScenes, TheSharedOnesRender) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(LIGHTMILL_SOURCE_DIR) / "../shared/scenes/gltf";
  if (!fs::exists(folder)) GTEST_SKIP() << "the shared scenes are not beside this checkout";
  int rendered = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".gltf" && extension != ".glb") continue;
    SCOPED_TRACE(entry.path().string());
    SceneDescription scene = load_scene_file(entry.path().string(), {}, [](const Problem&) {});
    scene.film.width = scene.film.height = 16;
    const Batches image = render_batches(scene, settings_for(scene, Integrator::kBdpt, 32, 8), 2);
    EXPECT_EQ(image.counters.nonfinite, 0u);
    EXPECT_GT(image.mean().mean, 0.01);
    ++rendered;
  }
  EXPECT_GE(rendered, 10);
}

}  // namespace
}  // namespace lightmill::test
