// Blender's materials against Cycles 3.4: a ball of radius 1 under a sun of strength 1, seen by a parallel
// camera from +z. The sun shines from the angle `degrees` to the camera, towards +x. Cycles' own values at
// places (x, y) of the picture; it leaves out what is below 0.01 by chance, so that dim places are not looked
// at.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>

#include "tests/support/test_scene.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"
#include "worker/render/scene/materials/mix.h"

namespace lightmill::test {
namespace {

struct Shown {
  const char* name;
  float x, y, degrees;
  Rgb radiance;
};
// clang-format off
const Shown kCycles[] = {
    {"princ_default", -0.109375f, 0.078125f, 40, {0.17874f, 0.17874f, 0.17874f}},
    {"princ_default", 0.578125f, 0.265625f, 40, {0.25148f, 0.25148f, 0.25148f}},
    {"princ_default", -0.546875f, -0.296875f, 40, {0.06943f, 0.06943f, 0.06943f}},
    {"princ_default", 0.578125f, 0.140625f, 80, {0.21782f, 0.21782f, 0.21782f}},
    {"princ_default", 0.390625f, -0.359375f, 80, {0.14017f, 0.14017f, 0.14017f}},
    {"princ_default", 0.828125f, -0.046875f, 80, {0.25407f, 0.25407f, 0.25407f}},
    {"princ_default", 0.828125f, 0.015625f, 130, {0.18504f, 0.18504f, 0.18504f}},
    {"princ_default", 0.765625f, -0.234375f, 130, {0.07572f, 0.07572f, 0.07572f}},
    {"princ_diffuse_r1", -0.109375f, 0.078125f, 40, {0.17604f, 0.11003f, 0.02201f}},
    {"princ_diffuse_r1", 0.578125f, 0.265625f, 40, {0.24532f, 0.15333f, 0.03067f}},
    {"princ_diffuse_r1", -0.546875f, -0.296875f, 40, {0.08246f, 0.05154f, 0.01031f}},
    {"princ_diffuse_r1", 0.578125f, 0.140625f, 80, {0.18082f, 0.11301f, 0.02260f}},
    {"princ_diffuse_r1", 0.390625f, -0.359375f, 80, {0.13750f, 0.08594f, 0.01719f}},
    {"princ_diffuse_r1", 0.828125f, -0.046875f, 80, {0.23501f, 0.14688f, 0.02938f}},
    {"princ_diffuse_r1", 0.828125f, 0.015625f, 130, {0.06769f, 0.04230f, 0.00846f}},
    {"princ_diffuse_r1", 0.765625f, -0.234375f, 130, {0.04886f, 0.03054f, 0.00611f}},
    {"princ_half", -0.109375f, 0.078125f, 40, {0.10547f, 0.06602f, 0.01341f}},
    {"princ_half", 0.578125f, 0.265625f, 40, {0.16116f, 0.10094f, 0.02064f}},
    {"princ_half", -0.546875f, -0.296875f, 40, {0.03520f, 0.02201f, 0.00443f}},
    {"princ_half", 0.578125f, 0.140625f, 80, {0.51885f, 0.32874f, 0.07527f}},
    {"princ_half", 0.390625f, -0.359375f, 80, {0.09064f, 0.05689f, 0.01189f}},
    {"princ_half", 0.828125f, -0.046875f, 80, {0.26555f, 0.16753f, 0.03683f}},
    {"princ_half", 0.828125f, 0.015625f, 130, {0.66433f, 0.45985f, 0.18721f}},
    {"princ_half", 0.765625f, -0.234375f, 130, {0.11129f, 0.07582f, 0.02853f}},
    {"princ_sheen", -0.109375f, 0.078125f, 40, {0.17559f, 0.10975f, 0.02195f}},
    {"princ_sheen", 0.578125f, 0.265625f, 40, {0.24519f, 0.15324f, 0.03065f}},
    {"princ_sheen", -0.546875f, -0.296875f, 40, {0.06902f, 0.04313f, 0.00863f}},
    {"princ_sheen", 0.578125f, 0.140625f, 80, {0.18119f, 0.11333f, 0.02287f}},
    {"princ_sheen", 0.390625f, -0.359375f, 80, {0.13617f, 0.08518f, 0.01718f}},
    {"princ_sheen", 0.828125f, -0.046875f, 80, {0.23352f, 0.14607f, 0.02947f}},
    {"princ_sheen", 0.828125f, 0.015625f, 130, {0.08695f, 0.05764f, 0.01857f}},
    {"princ_sheen", 0.765625f, -0.234375f, 130, {0.06194f, 0.04114f, 0.01340f}},
    {"princ_coat", 0.828125f, 0.015625f, 130, {0.02218f, 0.02218f, 0.02218f}},
    {"princ_aniso", -0.109375f, 0.078125f, 40, {0.01184f, 0.00740f, 0.00148f}},
    {"princ_aniso", 0.578125f, 0.265625f, 40, {0.02700f, 0.01688f, 0.00338f}},
    {"princ_aniso", 0.578125f, 0.140625f, 80, {0.81392f, 0.51098f, 0.10705f}},
    {"princ_aniso", 0.390625f, -0.359375f, 80, {0.06369f, 0.03999f, 0.00838f}},
    {"princ_aniso", 0.828125f, -0.046875f, 80, {0.20580f, 0.12920f, 0.02707f}},
    {"princ_aniso", 0.828125f, 0.015625f, 130, {0.55741f, 0.36985f, 0.11976f}},
    {"princ_aniso", 0.765625f, -0.234375f, 130, {0.05722f, 0.03796f, 0.01229f}},
    {"diffuse.7", -0.109375f, 0.078125f, 40, {0.15460f, 0.09662f, 0.01932f}},
    {"diffuse.7", 0.578125f, 0.265625f, 40, {0.20750f, 0.12969f, 0.02594f}},
    {"diffuse.7", -0.546875f, -0.296875f, 40, {0.07948f, 0.04968f, 0.00994f}},
    {"diffuse.7", 0.578125f, 0.140625f, 80, {0.10859f, 0.06787f, 0.01357f}},
    {"diffuse.7", 0.390625f, -0.359375f, 80, {0.09087f, 0.05679f, 0.01136f}},
    {"diffuse.7", 0.828125f, -0.046875f, 80, {0.14793f, 0.09245f, 0.01849f}},
    {"diffuse.7", 0.828125f, 0.015625f, 130, {0.02573f, 0.01608f, 0.00322f}},
    {"diffuse.7", 0.765625f, -0.234375f, 130, {0.01988f, 0.01243f, 0.00249f}},
    {"glossy_ggx", -0.109375f, 0.078125f, 40, {0.06258f, 0.03911f, 0.00782f}},
    {"glossy_ggx", 0.578125f, 0.265625f, 40, {0.12510f, 0.07818f, 0.01564f}},
    {"glossy_ggx", 0.578125f, 0.140625f, 80, {0.65164f, 0.40728f, 0.08146f}},
    {"glossy_ggx", 0.390625f, -0.359375f, 80, {0.07799f, 0.04874f, 0.00975f}},
    {"glossy_ggx", 0.828125f, -0.046875f, 80, {0.37334f, 0.23334f, 0.04667f}},
    {"glossy_ggx", 0.828125f, 0.015625f, 130, {0.79691f, 0.49807f, 0.09961f}},
    {"glossy_ggx", 0.765625f, -0.234375f, 130, {0.19856f, 0.12410f, 0.02482f}},
    {"glossy_beck", -0.109375f, 0.078125f, 40, {0.02862f, 0.01789f, 0.00358f}},
    {"glossy_beck", 0.578125f, 0.265625f, 40, {0.11146f, 0.06967f, 0.01393f}},
    {"glossy_beck", 0.578125f, 0.140625f, 80, {0.88172f, 0.55107f, 0.11021f}},
    {"glossy_beck", 0.390625f, -0.359375f, 80, {0.04350f, 0.02719f, 0.00544f}},
    {"glossy_beck", 0.828125f, -0.046875f, 80, {0.55367f, 0.34604f, 0.06921f}},
    {"glossy_beck", 0.828125f, 0.015625f, 130, {1.25215f, 0.78260f, 0.15652f}},
    {"glossy_beck", 0.765625f, -0.234375f, 130, {0.31953f, 0.19970f, 0.03994f}},
    {"glossy_as", -0.109375f, 0.078125f, 40, {0.02510f, 0.01569f, 0.00314f}},
    {"glossy_as", 0.578125f, 0.265625f, 40, {0.09393f, 0.05871f, 0.01174f}},
    {"glossy_as", 0.578125f, 0.140625f, 80, {0.77462f, 0.48414f, 0.09683f}},
    {"glossy_as", 0.390625f, -0.359375f, 80, {0.03464f, 0.02165f, 0.00433f}},
    {"glossy_as", 0.828125f, -0.046875f, 80, {0.38064f, 0.23790f, 0.04758f}},
    {"glossy_as", 0.828125f, 0.015625f, 130, {0.78045f, 0.48778f, 0.09756f}},
    {"glossy_as", 0.765625f, -0.234375f, 130, {0.15376f, 0.09610f, 0.01922f}},
    {"velvet", -0.546875f, -0.296875f, 40, {0.04087f, 0.02554f, 0.00511f}},
    {"toon", -0.109375f, 0.078125f, 40, {0.21419f, 0.13387f, 0.02677f}},
    {"toon", 0.578125f, 0.265625f, 40, {0.23319f, 0.14574f, 0.02915f}},
    {"toon", 0.578125f, 0.140625f, 80, {0.23319f, 0.14574f, 0.02915f}},
    {"toon", 0.390625f, -0.359375f, 80, {0.06650f, 0.04156f, 0.00831f}},
    {"toon", 0.828125f, -0.046875f, 80, {0.23319f, 0.14574f, 0.02915f}},
    {"toon_g", 0.578125f, 0.265625f, 40, {0.02387f, 0.01492f, 0.00298f}},
    {"toon_g", 0.578125f, 0.140625f, 80, {0.43471f, 0.27169f, 0.05434f}},
    {"toon_g", 0.390625f, -0.359375f, 80, {0.04130f, 0.02581f, 0.00516f}},
    {"toon_g", 0.828125f, -0.046875f, 80, {0.30785f, 0.19240f, 0.03848f}},
    {"toon_g", 0.828125f, 0.015625f, 130, {0.43471f, 0.27169f, 0.05434f}},
    {"toon_g", 0.765625f, -0.234375f, 130, {0.41424f, 0.25890f, 0.05178f}},
    {"glass_r", 0.578125f, 0.140625f, 80, {0.02967f, 0.01854f, 0.00371f}},
    {"glass_r", 0.828125f, -0.046875f, 80, {0.01812f, 0.01132f, 0.00226f}},
    {"glass_r", 0.828125f, 0.015625f, 130, {0.06902f, 0.04314f, 0.00863f}},
    {"glass_b", 0.578125f, 0.140625f, 80, {0.04409f, 0.02756f, 0.00551f}},
    {"glass_b", 0.828125f, -0.046875f, 80, {0.01250f, 0.00781f, 0.00156f}},
    {"glass_b", 0.828125f, 0.015625f, 130, {0.11051f, 0.06907f, 0.01381f}},
    {"princ_trans_half", -0.109375f, 0.078125f, 40, {0.08929f, 0.05638f, 0.01251f}},
    {"princ_trans_half", 0.578125f, 0.265625f, 40, {0.12615f, 0.08019f, 0.01890f}},
    {"princ_trans_half", -0.546875f, -0.296875f, 40, {0.03335f, 0.02091f, 0.00433f}},
    {"princ_trans_half", 0.578125f, 0.140625f, 80, {0.13161f, 0.09776f, 0.05263f}},
    {"princ_trans_half", 0.390625f, -0.359375f, 80, {0.06985f, 0.04447f, 0.01063f}},
    {"princ_trans_half", 0.828125f, -0.046875f, 80, {0.13541f, 0.09186f, 0.03379f}},
    {"princ_trans_half", 0.828125f, 0.015625f, 130, {0.15564f, 0.14355f, 0.12744f}},
    {"princ_trans_half", 0.765625f, -0.234375f, 130, {0.03920f, 0.03072f, 0.01943f}},
    {"princ_metal_s0", -0.109375f, 0.078125f, 40, {0.08660f, 0.05413f, 0.01083f}},
    {"princ_metal_s0", 0.578125f, 0.265625f, 40, {0.15568f, 0.09730f, 0.01946f}},
    {"princ_metal_s0", -0.546875f, -0.296875f, 40, {0.01392f, 0.00870f, 0.00174f}},
    {"princ_metal_s0", 0.578125f, 0.140625f, 80, {0.42606f, 0.26629f, 0.05326f}},
    {"princ_metal_s0", 0.390625f, -0.359375f, 80, {0.10302f, 0.06439f, 0.01288f}},
    {"princ_metal_s0", 0.828125f, -0.046875f, 80, {0.35253f, 0.22033f, 0.04407f}},
    {"princ_metal_s0", 0.828125f, 0.015625f, 130, {0.46119f, 0.28824f, 0.05765f}},
    {"princ_metal_s0", 0.765625f, -0.234375f, 130, {0.18012f, 0.11257f, 0.02251f}},
};
// clang-format on

const Rgb kColour{0.8f, 0.5f, 0.1f};

MaterialKind principled(const std::function<void(PrincipledMaterial&)>& edit) {
  PrincipledMaterial m;
  m.base_color.value = kColour;
  edit(m);
  return m;
}
MaterialKind closure(ClosureKind kind, float roughness,
                     const std::function<void(ClosureMaterial&)>& edit = {}) {
  ClosureMaterial m;
  m.closure = kind;
  m.color.value = kColour;
  m.roughness.value = roughness;
  if (edit) edit(m);
  return m;
}

std::map<std::string, MaterialKind> shown_materials() {
  const auto facets = [](FacetShape shape) { return [=](ClosureMaterial& m) { m.facets = shape; }; };
  return {{"princ_default", PrincipledMaterial{}},
          {"princ_diffuse_r1", principled([](auto& m) { m.specular.value = 0, m.roughness.value = 1; })},
          {"princ_half", principled([](auto& m) {
             m.metallic.value = 0.5f, m.roughness.value = 0.4f, m.specular_tint.value = 0.7f;
           })},
          {"princ_sheen", principled([](auto& m) { m.sheen.value = 1, m.specular.value = 0; })},
          {"princ_coat", principled([](auto& m) {
             m.base_color.value = {}, m.specular.value = 0, m.clearcoat.value = 1;
             m.clearcoat_roughness.value = 0.3f;
           })},
          {"princ_metal_s0",
           principled([](auto& m) { m.metallic.value = 1, m.roughness.value = 0.6f, m.specular.value = 0; })},
          {"diffuse.7", closure(ClosureKind::kDiffuse, 0.7f)},
          {"glossy_ggx", closure(ClosureKind::kGlossy, 0.5f)},
          {"glossy_beck", closure(ClosureKind::kGlossy, 0.5f, facets(FacetShape::kBeckmann))},
          {"glossy_as", closure(ClosureKind::kGlossy, 0.5f, facets(FacetShape::kAshikhminShirley))},
          {"velvet", closure(ClosureKind::kVelvet, 0.7f)},
          {"toon", closure(ClosureKind::kToon, 0.5f, [](auto& m) { m.anisotropy.value = 0.2f; })},
          {"toon_g",
           closure(ClosureKind::kToon, 0.3f, [](auto& m) { m.anisotropy.value = 0.2f, m.glossy = true; })},
          {"glass_r", closure(ClosureKind::kGlass, 0.4f)},
          {"glass_b", closure(ClosureKind::kGlass, 0.4f, facets(FacetShape::kBeckmann))}};
}

TEST(Blender, LobesAreThoseOfCycles) {
  const auto materials = shown_materials();
  TestScene s;
  std::map<std::string, size_t> number;
  for (const auto& [name, kind] : materials) {
    number[name] = s.scene.materials.size();
    s.scene.materials.push_back({"", kind, {}});
  }
  const RenderScene scene = build_scene(s.scene);
  int compared = 0;
  for (const Shown& shown : kCycles) {
    const auto found = number.find(shown.name);
    if (found == number.end()) continue;
    BsdfParams<float> params;
    params.tables = scene.bsdf_tables.data();
    for (size_t k = 0; k < kBsdfParams; ++k)
      params.p[k] = scene.material_params[found->second * kBsdfParams + k];
    const Frame<float> frame({shown.x, shown.y, std::sqrt(1 - shown.x * shown.x - shown.y * shown.y)});
    const double angle = shown.degrees * M_PI / 180;
    const Vec3<float> wo = frame.to_local({0, 0, 1});
    const Vec3<float> wi =
        frame.to_local({static_cast<float>(std::sin(angle)), 0, static_cast<float>(std::cos(angle))});
    const BsdfEval<float> e =
        eval_bsdf<float>(scene.material_kind[found->second], true, params, wo, wi, Mode::kRadiance);
    SCOPED_TRACE(std::string(shown.name) + " at " + std::to_string(shown.x) + " " + std::to_string(shown.y));
    const auto near = [&](float ours, float theirs) {
      EXPECT_NEAR(ours * wi.z, theirs, 2e-3f + 0.01f * theirs);
    };
    near(e.f.x, shown.radiance.r), near(e.f.y, shown.radiance.g), near(e.f.z, shown.radiance.b);
    ++compared;
  }
  EXPECT_GT(compared, 80);
}

// Radiance is not scaled where it is refracted, so importance is, as its adjoint.
TEST(Blender, SharpGlassScalesImportanceAlone) {
  for (const BsdfCase& bsdf : all_bsdfs()) {
    if (bsdf.name != "blender_glass") continue;
    Random random(3);
    for (int i = 0; i < 1000; ++i) {
      const Vec3<float> wo = square_to_sphere(random.uniform(), random.uniform());
      const BsdfSample<float> to = bsdf.sample(wo, random, Mode::kRadiance);
      ASSERT_TRUE(to.valid && to.delta);
      const float eta = wo.z > 0 ? 1.45f : 1 / 1.45f;
      float unused;
      const float reflected = fresnel_dielectric(std::abs(wo.z), eta, &unused);
      const float chance = glass_reflection_chance(reflected);
      // Of both lobes: what it scatters over the probability with which it is chosen.
      const auto weight = [&](const BsdfSample<float>& s) {
        return 0.8f * (s.wi.z * wo.z < 0 ? (1 - reflected) / (1 - chance) : reflected / chance);
      };
      ASSERT_NEAR(to.weight.x, weight(to), 1e-5f);
      const BsdfSample<float> of_importance = bsdf.sample(wo, random, Mode::kImportance);
      const bool refracted = of_importance.wi.z * wo.z < 0;
      ASSERT_NEAR(of_importance.weight.x, weight(of_importance) * (refracted ? 1 / (eta * eta) : 1), 1e-5f);
    }
  }
}

// A mix picks one part and scales it: on the average both are there with their weights.
TEST(Blender, MixesStandForBothParts) {
  for (const MixRule rule : {MixRule::kMixShader, MixRule::kAddShader}) {
    TestScene s;
    const int red = s.diffuse({0.9f, 0, 0}), green = s.diffuse({0, 0.3f, 0});
    MixMaterial mix;
    mix.materials = {red, green};
    mix.amount.value = 0.25f;
    mix.rule = rule;
    s.scene.materials.push_back({"", mix, {}});
    const RenderScene scene = build_scene(s.scene);
    const int root = static_cast<int>(s.scene.materials.size()) - 1;
    double weight[2] = {};
    Random random(5);
    constexpr int kPoints = 100'000;
    for (int i = 0; i < kPoints; ++i) {
      const float p[3] = {random.uniform(), random.uniform(), random.uniform()};
      const MixChoice choice = resolve_mix(scene, root, 0, p, {});
      weight[choice.material == green] += choice.scale / kPoints;
    }
    const bool adds = rule == MixRule::kAddShader;
    EXPECT_NEAR(weight[0], adds ? 1 : 0.75, 0.01);
    EXPECT_NEAR(weight[1], adds ? 1 : 0.25, 0.01);
  }
}

}  // namespace
}  // namespace lightmill::test
