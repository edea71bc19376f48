// Light that walks through bodies: closed answers by every estimator, and the agreement of all sets of
// strategy families.
//
// alpha = 1e-4 per comparison; `resolution` states the error that a comparison would notice.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/statistical/agreement/strategy_set.h"
#include "tests/support/scaled_scene.h"
#include "worker/render/bsdf/layered/coat_transfer.h"
#include "worker/render/bsdf/tables/half_space.h"

namespace lightmill::test {
namespace {

constexpr int kSubsurfaceBatches = 16;

int add_material(TestScene* s, const SubsurfaceMaterial& m) {
  s->scene.materials.push_back({"", m, {}});
  return static_cast<int>(s->scene.materials.size()) - 1;
}
SubsurfaceMaterial body_of(const Rgb& sigma_a, const Rgb& sigma_s, float g = 0, float eta = 1.33f,
                           float alpha = 0) {
  SubsurfaceMaterial m;
  m.sigma_a = sigma_a;
  m.sigma_s = sigma_s;
  m.g = g;
  m.eta = eta;
  m.roughness = {{alpha, -1}, {alpha, -1}, false};
  return m;
}

double fresnel(double cosine, double eta) {
  const double t = std::sqrt(1 - (1 - cosine * cosine) / (eta * eta));
  const double s = (cosine - eta * t) / (cosine + eta * t), p = (eta * cosine - t) / (eta * cosine + t);
  return (s * s + p * p) / 2;
}
/// 2 int (1 - F) mu dmu.
double mean_transmittance(double eta) {
  constexpr int kSteps = 20000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double mu = (i + 0.5) / kSteps;
    sum += 2 * mu * (1 - fresnel(mu, eta)) / kSteps;
  }
  return sum;
}

/// What a slab does to diffuse light that has entered at its top: the parts that leave above and below.
/// Independent of the walk: the medium by adding and doubling (coat_transfer.h), the boundary by the two
/// equations of what travels to and fro.
struct SlabAnswer {
  double above, below;
  SlabAnswer(double thickness, double albedo, double g, double eta) {
    const Slab slab = scattering_slab(thickness, albedo, g);
    Field diffuse;
    for (size_t i = 0; i < kStreams; ++i) diffuse[i] = 2 * streams().cosine[i] * streams().weight[i];
    const auto total = [&](const Operator& op) {
      double sum = 0;
      for (const double x : product(op, diffuse)) sum += x;
      return sum;
    };
    const double r = total(slab.reflect), t = total(slab.transmit);
    const double leaves = mean_transmittance(eta) / (eta * eta), stays = 1 - leaves;
    // What meets the top from inside, u, and the bottom, d: u = r (1 + stays u) + t stays d, and
    // d = t (1 + stays u) + r stays d.
    const double a = 1 - r * stays, b = t * stays, determinant = a * a - b * b;
    const double u = (r * a + t * b) / determinant, d = (t * a + r * b) / determinant;
    above = leaves * u;
    below = leaves * d;
  }
};

class Subsurface : public ::testing::TestWithParam<Integrator> {
 protected:
  Batches render(const TestScene& s, int max_depth, int64_t spp) const {
    Batches b =
        render_batches(s.scene, settings_for(s.scene, GetParam(), spp, max_depth), kSubsurfaceBatches);
    EXPECT_EQ(b.counters.nonfinite, 0u);
    return b;
  }
};

// A body that absorbs nothing, in an even light from all around, is not to be seen: whatever its medium and
// its boundary are. Not by lt: camera paths alone see the sky and its reflection.
using SubsurfaceFurnace = Subsurface;
TEST_P(SubsurfaceFurnace, NothingIsLostWhereNothingIsAbsorbed) {
  for (const float density : {0.3f, 3.0f, 30.0f}) {
    for (const float g : {-0.5f, 0.9f}) {
      SCOPED_TRACE(testing::Message() << "density " << density << " g " << g);
      TestScene s;
      s.sphere({0, 0, 0}, 0.5,
               add_material(&s, body_of({0, 0, 0}, {0.5f * density, density, 0.25f * density}, g, 1.5f)));
      s.box({2, -0.5, -0.5}, {3, 0.5, 0.5},
            add_material(&s, body_of({0, 0, 0}, {density, density, density}, g, 1.2f)));
      s.environment({1, 1, 1}).camera({1, 0.9, -4}, {1.2, 0, 0}, 40).film(8, 8);
      const Batches b = render(s, kUnlimitedDepth, 2048);
      for (int c = 0; c < 3; ++c)
        EXPECT_TRUE(mean_is(b.mean(c), 1, {.resolution = 0.02, .rounding = 1e-4})) << c;
    }
  }
}

/// A wide slab of thickness 1, lit by the sun at cosine 0.8, seen from above or from below at an angle.
TestScene lit_slab(const SubsurfaceMaterial& m, bool from_above) {
  TestScene s;
  constexpr double kWide = 8;
  s.box({-kWide, -0.5, -kWide}, {kWide, 0.5, kWide}, add_material(&s, m));
  s.scene.lights.push_back({DistantLight{{1, 1, 1}, {0.6, -0.8, 0}}, {}});
  s.camera({0, from_above ? 3.0 : -3.0, -1}, {0, from_above ? 0.5 : -0.5, 1}, 20).film(8, 8);
  return s;
}

// Against the medium's transfer by adding and doubling, per channel.
TEST_P(Subsurface, SlabReflectsAndTransmitsAsItsTransferSays) {
  struct {
    Rgb sigma_a, sigma_s;
    float g;
  } const cases[] = {{{0.1f, 0.5f, 2}, {1, 1, 1}, 0}, {{0, 0.2f, 0.05f}, {4, 2, 8}, 0.7f}};
  for (const auto& c : cases) {
    for (const bool above : {true, false}) {
      SCOPED_TRACE(testing::Message() << "g " << c.g << (above ? " above" : " below"));
      const TestScene s = lit_slab(body_of(c.sigma_a, c.sigma_s, c.g), above);
      const Batches b = render(s, 1, GetParam() == Integrator::kLt ? 32768 : 2048);
      const float a[3] = {c.sigma_a.r, c.sigma_a.g, c.sigma_a.b},
                  sc[3] = {c.sigma_s.r, c.sigma_s.g, c.sigma_s.b};
      constexpr float kEta = 1.33f;
      // (1 - F) / (T~ pi) towards the camera, over the film.
      constexpr int kSteps = 32;
      double lobe = 0;
      for (int y = 0; y < kSteps; ++y) {
        for (int x = 0; x < kSteps; ++x) {
          const Vec3d w = camera_direction(s.scene, 8 * (x + 0.5) / kSteps, 8 * (y + 0.5) / kSteps);
          lobe += (1 - fresnel(std::fabs(w.y), kEta)) / (kSteps * kSteps);
        }
      }
      lobe /= mean_transmittance(kEta) * M_PI;
      for (int k = 0; k < 3; ++k) {
        const double total = double{a[k]} + double{sc[k]};
        const float leaves = static_cast<float>(mean_transmittance(kEta) / (kEta * kEta));
        const float albedo = walk_albedo({kEta, 0, 0}, sc[k] / (a[k] + sc[k]), c.g, leaves);
        const SlabAnswer slab(total, double{albedo}, double{c.g}, kEta);
        const double expected = 0.8 * (1 - fresnel(0.8, kEta)) * (above ? slab.above : slab.below) * lobe;
        const double noise = GetParam() == Integrator::kLt ? 0.3 : 0.06;
        EXPECT_TRUE(mean_is(b.mean(k), expected, {.resolution = noise, .rounding = 2e-3})) << "channel " << k;
      }
    }
  }
}

// The reflectance that is asked for is the one of a deep body, besides the reflection of its boundary.
TEST(SubsurfaceReflectance, IsThatOfADeepBody) {
  for (const float g : {0.0f, 0.8f}) {
    SubsurfaceMaterial m;
    m.reflectance = SpectrumInput{{0.1f, 0.5f, 0.9f}, -1};
    m.mfp = {0.02f, 0.01f, 0.005f};
    m.g = g;
    TestScene s;
    s.box({-5, -5, -5}, {5, 0, 5}, add_material(&s, m));
    s.scene.lights.push_back({DistantLight{{1, 1, 1}, {0, -1, 0}}, {}});
    s.camera({0, 3, 0}, {0, 0, 0}, 5).film(8, 8);
    const Batches b =
        render_batches(s.scene, settings_for(s.scene, Integrator::kPt, 4096, 1), kSubsurfaceBatches);
    constexpr double kEta = 1.33f;
    const double through = 1 - fresnel(1, kEta), lobe = through * through / (mean_transmittance(kEta) * M_PI);
    const double wanted[3] = {0.1, 0.5, 0.9};
    for (int c = 0; c < 3; ++c) {
      EXPECT_TRUE(mean_is(b.mean(c), lobe * wanted[c], {.resolution = 0.05, .rounding = 0.006}))
          << "g " << g << " channel " << c;
    }
  }
}

// Two boxes of one material that overlap are one body: from within neither has an end where the other goes
// on.
TEST_P(Subsurface, BodiesThatOverlapAreOne) {
  const SubsurfaceMaterial m = body_of({0.1f, 0.5f, 2}, {4, 4, 4}, 0.3f);
  const auto boxes = [&](bool two) {
    TestScene s;
    const int milk = add_material(&s, m);
    s.box({-1, -0.5, -1}, {1, two ? 0.1 : 0.5, 1}, milk);
    if (two) s.box({-0.999, -0.2, -0.999}, {0.999, 0.5, 0.999}, milk);
    s.scene.lights.push_back({DistantLight{{1, 1, 1}, {0.6, -0.8, 0}}, {}});
    s.camera({0, 3, -1}, {0, 0.5, 0}, 25).film(16, 16);
    return s;
  };
  const int64_t spp = GetParam() == Integrator::kLt ? 12288 : 512;
  const Batches one = render(boxes(false), 2, spp), two = render(boxes(true), 2, spp);
  EXPECT_TRUE(images_agree(one, two));
  EXPECT_FALSE(images_agree(one, scaled(two, 1.05f))) << "the test notices nothing";
}

/// A lamp out of sight; a smooth body with a ball in it, a rough one, and a sheet of what the smooth one is
/// of. Where the smooth ones are `mirrors`, the lamp is in sight in them, and light comes to the floor by
/// them.
TestScene room_of_bodies(bool mirrors = true) {
  TestScene s = cornell_room();
  const int milk = add_material(&s, body_of({0.05f, 0.2f, 0.8f}, {4, 3, 2}, 0.3f, mirrors ? 1.33f : 1.0f));
  const int wax = add_material(&s, body_of({0.3f, 0.1f, 0.1f}, {6, 3, 9}, -0.2f, 1.5f, 0.3f));
  s.sphere({-0.4, -0.65, 0.2}, 0.34, milk);
  s.sphere({-0.4, -0.65, 0.2}, 0.1, s.diffuse(0.9f));
  s.box({0.1, -0.999, 0.2}, {0.5, -0.5, 0.6}, wax);
  s.quad({-0.2, -0.999, -0.1}, {0, 0.4, 0}, {0.4, 0, 0}, milk);
  s.camera({0, 0.6, -0.95}, {0, -1, 0.3}, 70).film(16, 16);
  return s;
}

class SubsurfaceStrategySet : public ::testing::TestWithParam<unsigned> {};

// What smooth bodies reflect hits alone can see in all places.
TEST_P(SubsurfaceStrategySet, AgreesInARoomOfBodies) {
  const bool mirrors = (GetParam() & kEmissionHits) != 0;
  expect_agrees_with_all(room_of_bodies(mirrors), GetParam(),
                         {.max_depth = 5,
                          .spp = 2048,
                          .weak_spp = 8192,
                          .all_spp = 2048,
                          .once_spp = 1024,
                          .notice = 1.05f,
                          .connections_notice = 1.1f});
}

// Coefficients are per length: with 2^-k of them, a scene 2^k times as large has the same bits.
TEST(SubsurfaceScale, PowersOfTwoChangeNoBit) {
  const TestScene s = room_of_bodies();
  const auto render_one = [](const SceneDescription& scene) {
    return render_batches(scene, settings_for(scene, Integrator::kBdpt, 16, 4), 1).images[0].data;
  };
  const auto expected = render_one(s.scene);
  for (const int k : {-40, 3, 40}) EXPECT_EQ(expected, render_one(scaled_scene(s.scene, k))) << k;
}

INSTANTIATE_TEST_SUITE_P(All, Subsurface,
                         ::testing::Values(Integrator::kPt, Integrator::kLt, Integrator::kBdpt),
                         [](const auto& info) { return name_of(info.param); });
INSTANTIATE_TEST_SUITE_P(All, SubsurfaceFurnace, ::testing::Values(Integrator::kPt, Integrator::kBdpt),
                         [](const auto& info) { return name_of(info.param); });
INSTANTIATE_TEST_SUITE_P(All, SubsurfaceStrategySet, ::testing::Range(1u, kAllStrategies + 1), set_name);

}  // namespace
}  // namespace lightmill::test
