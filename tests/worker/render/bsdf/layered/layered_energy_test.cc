// The layered BSDFs against a random walk_stack through their layers, written again here with the
// metal's own Fresnel reflectance: coat, base, coat, ... until the light has left.
//
// The walk_stack, not pbrt's picture, is the reference for rough coats. pbrt-v4 draws the same
// walk_stack, but weighs its strategies by densities that are approximations for layers, and the
// weights of one path do not add up to 1: its path integrator differs from its own light sampling alone by
// some percent (mmp/pbrt-v4 issue 187).
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/test_scene.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"
#include "worker/render/bsdf/conductor.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill::test {
namespace {

struct LayerStack {
  float eta, thickness, coat_alpha;
  bool metal;            // else Lambertian
  float metal_alpha;     // of the metal
  float reflectance[3];  // of a Lambertian base; of the metal against air at normal incidence
};

/// What leaves the layers per unit of light that arrives along `wo`, and whither.
Vec3<float> walk_stack(const LayerStack& layers, const Vec3<float>& wo, Random& random,
                       Vec3<float>* out = nullptr) {
  BsdfParams<float> coat, base;
  coat.p[0] = layers.eta;
  coat.p[6] = layers.coat_alpha;
  base.p[6] = layers.metal_alpha;
  for (size_t c = 0; c < 3; ++c) {
    const float r = std::min(layers.reflectance[c], 0.9999f);
    base.p[c] = layers.metal ? 1 / layers.eta : r;
    base.p[c + 3] = 2 * std::sqrt(r) / std::sqrt(1 - r) / layers.eta;
  }
  const auto meet = [&](int32_t kind, const BsdfParams<float>& params, const Vec3<float>& from) {
    const float lobe = random.uniform(), u = random.uniform(), v = random.uniform();
    return sample_bsdf<float>(kind, true, params, from, lobe, u, v, Mode::kImportance);
  };
  const auto interface_kind = layers.coat_alpha > 0 ? kRoughDielectric : kSmoothDielectric;
  const auto base_kind = !layers.metal            ? kDiffuse
                         : layers.metal_alpha > 0 ? kRoughConductor
                                                  : kSmoothConductor;
  Vec3<float> weight{1, 1, 1};
  Vec3<float> from = wo;
  for (int i = 0; i < 5; ++i) {  // as many hits of the base as pbrt's maxdepth 10 has
    const BsdfSample<float> s = meet(interface_kind, coat, from);
    if (!s.valid) return {};
    weight = weight * s.weight;
    if (out) *out = s.wi;
    if (s.wi.z > 0) return weight;
    const BsdfSample<float> b = meet(base_kind, base, -s.wi);
    if (!b.valid) return {};
    const auto loss = static_cast<float>(std::exp(-layers.thickness / std::fabs(s.wi.z)) *
                                         std::exp(-layers.thickness / std::fabs(b.wi.z)));
    weight = weight * b.weight * loss;
    from = -b.wi;
  }
  const BsdfSample<float> s = meet(interface_kind, coat, from);
  if (out) *out = s.wi;
  return s.valid && s.wi.z > 0 ? weight * s.weight : Vec3<float>{};
}

struct Albedo {
  double c[3] = {0, 0, 0};
};
template <class Fn>
Albedo mean(int n, Fn&& one) {
  Albedo a;
  for (int i = 0; i < n; ++i) {
    const Vec3<float> w = one();
    a.c[0] += w.x, a.c[1] += w.y, a.c[2] += w.z;
  }
  for (double& c : a.c) c /= n;
  return a;
}

BsdfCase only_material(const TestScene& s, std::vector<float>* tables) {
  const RenderScene scene = build_scene(s.scene);
  BsdfCase c{"", scene.material_kind[0], {}, 0};
  for (size_t k = 0; k < kBsdfParams; ++k) c.params.p[k] = scene.material_params[k];
  *tables = scene.bsdf_tables;
  c.params.tables = tables->data();
  return c;
}

/// The albedos of model and walk_stack agree in every channel within 3 % and `tolerance`.
void compare_energy(const LayerStack& layers, const BsdfCase& model, double tolerance,
                    const std::string& name) {
  for (const double degrees : {0.0, 30.0, 60.0, 80.0}) {
    const Vec3<float> wo = direction_at(degrees);
    Random r1(1), r2(2);
    const Albedo w = mean(20000, [&] { return walk_stack(layers, wo, r1); });
    const Albedo m = mean(20000, [&] {
      const BsdfSample<float> s = model.sample(wo, r2, Mode::kImportance);
      return s.valid ? s.weight : Vec3<float>{};
    });
    for (const size_t c : {0u, 1u, 2u})
      EXPECT_NEAR(m.c[c], w.c[c], 0.03 * w.c[c] + tolerance) << name << " at " << degrees << " channel " << c;
  }
}

TEST(LayeredEnergy, CoatedConductorHasTheAlbedoOfTheWalk) {
  for (const float eta : {1.2f, 1.5f, 2.0f}) {
    for (const float coat : {0.0f, 0.1f, 0.4f}) {
      for (const float metal : {0.0f, 0.1f, 0.3f, 1.0f}) {
        const float thickness = metal == 0.3f ? 0.2f : 0.01f;
        TestScene s;
        s.coated_conductor({0.95f, 0.6f, 0.2f}, eta, coat, metal);
        std::get<CoatedConductorMaterial>(s.scene.materials[0].kind).thickness = thickness;
        std::vector<float> tables;
        compare_energy({eta, thickness, coat, true, metal, {0.95f, 0.6f, 0.2f}}, only_material(s, &tables),
                       coat > 0.1f ? 0.04 : 0.02,
                       "eta " + std::to_string(eta) + " coat " + std::to_string(coat) + " metal " +
                           std::to_string(metal));
      }
    }
  }
}

// How sharp a metal looks through a rough coat: of the light that leaves, as much lies within a few degrees
// of the mirror direction as the walk_stack brings there, within 30 %. (The model blurs by one lobe,
// of one width for all directions, in place of two refractions.)
TEST(LayeredEnergy, CoatBlursAMetalAsTheWalkDoes) {
  for (const float coat : {0.1f, 0.3f}) {
    for (const float metal : {0.0f, 0.1f, 0.3f}) {
      TestScene s;
      s.coated_conductor({0.95f, 0.95f, 0.95f}, 1.5f, coat, metal);
      std::vector<float> tables;
      const BsdfCase model = only_material(s, &tables);
      const LayerStack layers{1.5f, 0.01f, coat, true, metal, {0.95f, 0.95f, 0.95f}};
      for (const double degrees : {0.0, 45.0}) {
        const Vec3<float> wo = direction_at(degrees), mirror{-wo.x, -wo.y, wo.z};
        for (const double cone : {4.0, 12.0}) {
          const auto edge = static_cast<float>(std::cos(cone * 3.14159265 / 180));
          Random r1(5), r2(6);
          const Albedo w = mean(40000, [&] {
            Vec3<float> wi{};
            const Vec3<float> weight = walk_stack(layers, wo, r1, &wi);
            return dot(wi, mirror) > edge ? weight : Vec3<float>{};
          });
          const Albedo m = mean(40000, [&] {
            const BsdfSample<float> b = model.sample(wo, r2, Mode::kImportance);
            return b.valid && dot(b.wi, mirror) > edge ? b.weight : Vec3<float>{};
          });
          EXPECT_NEAR(m.c[0], w.c[0], 0.3 * w.c[0] + 0.005)
              << "coat " << coat << " metal " << metal << " at " << degrees << " within " << cone;
        }
      }
    }
  }
}

// White metal in a white furnace: with compensation it stays white, whatever its roughness. At alpha 1 two
// thirds of the samples leave downwards and the rest weigh up to 4: the standard error of the mean is then
// 0.0015.
TEST(LayeredEnergy, CompensatedWhiteMetalStaysWhite) {
  for (const float alpha : {0.05f, 0.1f, 0.25f, 0.5f, 0.75f, 1.0f}) {
    BsdfCase c{"white", kRoughConductor, {}, alpha};
    const CosineRow row = compensation_row(alpha);
    c.params.tables = row.data();
    for (const size_t i : {0u, 1u, 2u}) c.params.p[i] = 1;
    for (const size_t i : {3u, 4u, 5u}) c.params.p[i] = 1e6f;
    c.params.p[6] = alpha;
    c.params.p[7] = 1;
    for (const double degrees : {0.0, 20.0, 41.0, 60.0, 75.0, 84.0, 180.0}) {
      Random random(3);
      const Vec3<float> wo = direction_at(degrees);
      const Albedo a = mean(600000, [&] {
        const BsdfSample<float> s = c.sample(wo, random);
        return s.valid ? s.weight : Vec3<float>{};
      });
      EXPECT_NEAR(a.c[0], 1, 0.01) << "alpha " << alpha << " at " << degrees;
    }
    // Reciprocal, and the sampled weight is that of the value.
    Random random(4);
    for (int i = 0; i < 200; ++i) {
      const Vec3<float> wo = square_to_cosine_hemisphere(random.uniform(), random.uniform());
      const BsdfSample<float> s = c.sample(wo, random);
      if (!s.valid || s.wi.z < 1e-2f || wo.z < 1e-2f) continue;
      const BsdfEval<float> there = c.eval(wo, s.wi), back = c.eval(s.wi, wo);
      EXPECT_NEAR(there.f.x / back.f.x, 1, 1e-4f);
      EXPECT_NEAR(there.f.x * s.wi.z / there.pdf, s.weight.x, 5e-3f * s.weight.x);
    }
  }
}

TEST(LayeredEnergy, CompensationIsAnOptionOfTheScene) {
  TestScene s;
  s.conductor(0.9f, 0.5f);
  EXPECT_EQ(build_scene(s.scene).material_params[7], 0);
  const RenderScene scene = build_scene(s.scene, true);
  EXPECT_EQ(scene.material_params[7], 1);
  EXPECT_EQ(scene.bsdf_tables.size(), size_t{kCosineNodes});
}

TEST(LayeredEnergy, CoatedDiffuseHasTheAlbedoOfTheWalk) {
  for (const float eta : {1.2f, 1.5f, 2.0f}) {
    for (const float coat : {0.0f, 0.1f, 0.4f, 0.8f}) {
      TestScene s;
      s.coated({0.95f, 0.6f, 0.2f}, eta, coat);
      std::vector<float> tables;
      compare_energy({eta, 0.01f, coat, false, 0, {0.95f, 0.6f, 0.2f}}, only_material(s, &tables), 0.004,
                     "eta " + std::to_string(eta) + " coat " + std::to_string(coat));
    }
  }
}

}  // namespace
}  // namespace lightmill::test
