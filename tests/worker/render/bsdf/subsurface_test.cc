// The boundary of bodies that light walks through, and how much a deep one reflects.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/test_scene.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"
#include "worker/render/bsdf/bsdf_dispatch.h"
#include "worker/render/bsdf/layered/coat_transfer.h"
#include "worker/render/bsdf/tables/half_space.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill::test {
namespace {

/// Boundaries of both kinds; the parameters point into `scene`.
struct Boundaries {
  RenderScene scene;
  struct One {
    float eta;
    BsdfKind kind, exit;
    BsdfParams<float> params, dielectric;  // and that of the same boundary
  };
  std::vector<One> all;

  Boundaries() : scene(build_scene(description())) {
    for (size_t i = 0; i < scene.material_kind.size(); ++i) {
      if (!enters_bodies<float>(scene.material_kind[i])) continue;
      One one{scene.material_params[i * kBsdfParams + 3], scene.material_kind[i], kSubsurfaceExit, {}, {}};
      if (one.kind == kRoughSubsurface) one.exit = kRoughSubsurfaceExit;
      std::copy_n(&scene.material_params[i * kBsdfParams], kBsdfParams, one.params.p);
      std::copy_n(&scene.material_params[(i + 1) * kBsdfParams], kBsdfParams, one.dielectric.p);
      one.params.tables = one.dielectric.tables = scene.bsdf_tables.data();
      all.push_back(one);
    }
  }
  static SceneDescription description() {
    TestScene s;
    for (const float eta : {1.1f, 1.33f, 1.8f}) {
      for (const float alpha : {0.0f, 0.15f, 0.5f}) {
        SubsurfaceMaterial m;
        m.eta = eta;
        m.roughness = {{alpha, -1}, {alpha, -1}, false};
        s.scene.materials.push_back({"", m, {}});
        s.dielectric(eta, alpha);
      }
    }
    return s.scene;
  }
};

/// Calls fn(u, v) with the middles of a grid's cells.
template <class Fn>
void over_square(int n, Fn&& fn) {
  for (int i = 0; i < n * n; ++i)
    fn((static_cast<float>(i % n) + 0.5f) / static_cast<float>(n),
       (static_cast<float>(i / n) + 0.5f) / static_cast<float>(n));
}

// f |cos| of what leaves is a density over the hemisphere, and sampling it gives that.
TEST(SubsurfaceBoundary, WhatLeavesLeavesWhole) {
  const Boundaries boundaries;
  ASSERT_EQ(boundaries.all.size(), 9u);
  for (const auto& b : boundaries.all) {
    for (const float side : {1.0f, -1.0f}) {
      double energy = 0;
      constexpr int kGrid = 256;
      over_square(kGrid, [&](float u, float v) {
        const auto s = sample_bsdf<float>(b.exit, true, b.params, {0, 0, side}, 0.5f, u, v, Mode::kRadiance);
        if (!s.valid) return;
        energy += double{s.weight.x} / (kGrid * kGrid);
        const auto e = eval_bsdf<float>(b.exit, true, b.params, {0, 0, side}, s.wi, Mode::kRadiance);
        EXPECT_GT(s.wi.z * side, 0);
        EXPECT_NEAR(e.pdf, s.pdf, 1e-6f);
        EXPECT_EQ(e.pdf_reverse, s.pdf_reverse);
        EXPECT_NEAR(e.f.x * std::fabs(s.wi.z), s.weight.x * s.pdf, 1e-6f);
      });
      EXPECT_NEAR(energy, 1, 2e-3) << "eta " << b.eta << " alpha " << b.params.p[6];
      const auto inside =
          eval_bsdf<float>(b.exit, true, b.params, {0, 0, side}, {0, 0.6f, -0.8f * side}, Mode::kRadiance);
      EXPECT_EQ(inside.f.x, 0);
    }
  }
}

// Like the dielectric's: what does not enter is reflected where the boundary is smooth, and facets lose what
// they would reflect more than once.
TEST(SubsurfaceBoundary, ReflectsWhatDoesNotEnter) {
  const Boundaries boundaries;
  for (const auto& b : boundaries.all) {
    for (const double degrees : {0.0, 40.0, 75.0}) {
      const Vec3<float> wo = direction_at(degrees);
      double entering = 0, chosen = 0, reflected = 0, entered_weight = 0, reflected_weight = 0, pdf = 0;
      double transmitted_by_glass = 0, reflected_by_glass = 0;
      constexpr int kGrid = 24, kLobes = 256;
      over_square(kGrid, [&](float u, float v) {
        for (int i = 0; i < kLobes; ++i) {
          const float lobe = (static_cast<float>(i) + 0.5f) / kLobes;
          const auto s = sample_bsdf<float>(b.kind, true, b.params, wo, lobe, u, v, Mode::kRadiance);
          if (b.kind == kRoughSubsurface) {
            const auto glass =
                sample_bsdf<float>(kRoughDielectric, true, b.dielectric, wo, lobe, u, v, Mode::kImportance);
            if (glass.valid)
              (glass.wi.z < 0 ? transmitted_by_glass : reflected_by_glass) +=
                  double{glass.weight.x} / (kGrid * kGrid * kLobes);
          }
          if (!s.valid) continue;
          const double share = double{s.weight.x} / (kGrid * kGrid * kLobes);
          (s.wi.z < 0 ? entering : reflected) += share;
          if (s.wi.z < 0) {
            chosen += 1.0 / (kGrid * kGrid * kLobes);
            entered_weight = double{s.weight.x}, pdf = double{s.pdf};
            EXPECT_NEAR(s.pdf_reverse, wo.z / M_PI, 1e-6);
            EXPECT_FALSE(s.delta);
          } else if (s.delta) {
            reflected_weight = double{s.weight.x};
          } else {
            const auto e = eval_bsdf<float>(b.kind, true, b.params, wo, s.wi, Mode::kRadiance);
            EXPECT_EQ(e.pdf, s.pdf);
          }
        }
      });
      SCOPED_TRACE(testing::Message() << "eta " << b.eta << " alpha " << b.params.p[6] << " at " << degrees);
      if (b.kind == kSubsurface) {
        EXPECT_NEAR(pdf * entered_weight + (1 - pdf) * reflected_weight, 1, 1e-5);
        EXPECT_NEAR(chosen, pdf, 1.0 / kLobes);
      } else {
        EXPECT_NEAR(entering, transmitted_by_glass, 0.015);
        EXPECT_NEAR(reflected, reflected_by_glass, 0.005);
      }
      const auto out = eval_bsdf<float>(b.exit, true, b.params, {0, 0, 1}, wo, Mode::kRadiance);
      EXPECT_NEAR(out.pdf_reverse, chosen, 0.02) << "the densities of both ends are of one boundary";
    }
  }
}

/// Part of light from all around that a half space without boundary returns, by adding and doubling.
double half_space(double albedo, double g) {
  const Slab deep = scattering_slab(std::ldexp(1.0, 14) / (1 - g), albedo, g);
  Field diffuse;
  for (size_t i = 0; i < kStreams; ++i) diffuse[i] = 2 * streams().cosine[i] * streams().weight[i];
  double sum = 0;
  for (const double x : product(deep.reflect, diffuse)) sum += x;
  return sum;
}

// The closed form, and its inverse.
TEST(DeepBody, ReflectsAsItsTransferSays) {
  for (const float g : {-0.5f, 0.0f, 0.8f}) {
    for (const float albedo : {0.05f, 0.4f, 0.9f, 0.999f}) {
      const double exact = half_space(double{albedo}, double{g});
      const float r = body_reflectance<float>(albedo, 1, g);
      EXPECT_NEAR(r, exact, g < 0 ? 0.01 : 0.0025) << "g " << g << " albedo " << albedo;
    }
    for (const float leaves : {1.0f, 0.5f, 0.3f}) {
      for (const float r : {0.0f, 0.001f, 0.1f, 0.5f, 0.9f, 0.99f, 1.0f})
        EXPECT_NEAR(body_reflectance<float>(albedo_of_body(r, leaves, g), leaves, g), r, 5e-4f)
            << "g " << g << " leaves " << leaves;
    }
  }
}

// Against random walks of 600,000 particles each, in a script of its own: diffuse light is refracted into a
// half space by a smooth boundary, scattered, and refracted out or reflected by it.
TEST(DeepBody, BehindARefractingBoundaryReflectsAsRandomWalksSay) {
  struct {
    float eta, albedo, g;
    double reflected;  // of what enters
  } const cases[] = {{1.33f, 0.9585f, 0, 0.4442},  {1.33f, 0.8381f, 0, 0.2171}, {1.33f, 0.6779f, 0, 0.1181},
                     {1.33f, 0.99f, 0.8f, 0.4138}, {1.5f, 0.9f, 0, 0.2379},     {1.5f, 0.98f, 0.5f, 0.3800}};
  for (const auto& c : cases) {
    const CoatDescription boundary{c.eta, 0, 0};
    EXPECT_NEAR(refracted_body_reflectance(boundary, double{c.albedo}, double{c.g}), c.reflected, 0.004)
        << "albedo " << c.albedo << " g " << c.g;
    const float leaves = c.eta == 1.5f ? 0.4036f : 0.528f;  // T~ / eta^2
    const float walk = walk_albedo(boundary, c.albedo, c.g, leaves);
    EXPECT_LT(walk, c.albedo) << "light that enters diffusely does not get as deep";
    EXPECT_NEAR(body_reflectance<float>(walk, leaves, c.g), c.reflected, 0.005);
  }
  EXPECT_EQ(walk_albedo({1.33f, 0, 0}, 1, 0, 0.5f), 1);
  EXPECT_NEAR(walk_albedo({1.33f, 0, 0}, 0, 0, 0.5f), 0, 1e-6f);
}

}  // namespace
}  // namespace lightmill::test
