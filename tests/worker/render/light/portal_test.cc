// Portals: which rays leave through one, densities in both directions of use, equal bits in lanes, and what
// the scene builder refuses.
#include "worker/render/light/portal.h"

#include <gtest/gtest.h>

#include "common/base/error.h"
#include "tests/worker/render/light/light_cases.h"

namespace lightmill::test {
namespace {

/// A window of 1 x 0.5 in the plane y = 1, which opens upwards, under a white sky.
TestScene window(bool downwards = false) {
  TestScene s;
  s.quad({-1, -1, -1}, {0, 0, 2}, {2, 0, 0}, s.diffuse(0.5f));
  InfiniteLight sky{{1, 0.5f, 0.25f}};
  sky.portal = {{{-0.5, 1, -0.25}, {0.5, 1, -0.25}, {0.5, 1, 0.25}, {-0.5, 1, 0.25}}};
  if (downwards) std::swap((*sky.portal)[1], (*sky.portal)[3]);
  s.scene.lights.push_back({sky, {"scene.pbrt", 7, 1}});
  return s;
}

TEST(Portal, RaysLeaveThroughTheRectangleAlone) {
  const float center[3] = {0, 0, 0};
  const Portal p =
      make_portal({{{-0.5, 1, -0.25}, {0.5, 1, -0.25}, {0.5, 1, 0.25}, {-0.5, 1, 0.25}}}, center, 2);
  EXPECT_EQ(p.normal.y, 1);
  EXPECT_EQ(p.area, 0.5f);
  const auto out = [&](Vec3<float> o, Vec3<float> to) { return passes<float>(p, o, normalize(to - o)); };
  EXPECT_TRUE(out({0, 0, 0}, {0, 1, 0}));
  EXPECT_TRUE(out({0, 0, 0}, {0.499f, 1, 0.249f}));
  EXPECT_FALSE(out({0, 0, 0}, {0.501f, 1, 0}));
  EXPECT_FALSE(out({0, 0, 0}, {0, 1, -0.251f}));
  EXPECT_TRUE(out({9, 0.9f, 0}, {0.49f, 1, 0}));
  EXPECT_FALSE(out({0, 0, 0}, {0, -1, 0})) << "away from it";
  EXPECT_FALSE(out({0, 2, 0}, {0, 1, 0})) << "against its normal";
  EXPECT_FALSE(out({0, 2, 0}, {0, 3, 0})) << "it is behind";
  EXPECT_FALSE(out({0, 0, 0}, {1, 0, 0})) << "along it";
}

// What is drawn at a point under the window passes it or is dark, and E = mean of L cos / pdf is that of a
// rectangle of the same radiance, in both halves of the draw together.
TEST(Portal, DirectSamplingGivesTheIrradianceOfTheRectangle) {
  const LightScene scene(window());
  const Portal& portal = scene.lights().portals.at(0);
  Random random(3);
  for (const double depth : {0.9, 0.5, 0.05}) {
    const Vec3<float> at = scene.at(0.1, 1 - depth, 0);
    int dark = 0, total = 0;
    const Estimate e = mean_of(200000, [&] {
      const auto s =
          sample_direct<float>(scene.lights(), at, 0, random.uniform(), random.uniform(), random.uniform());
      ++total;
      if (!(s.radiance.x > 0)) {
        ++dark;
        return 0.0;
      }
      EXPECT_TRUE(passes(portal, at, s.wi));
      return double{s.radiance.x} * double{s.wi.y} / double{s.pdf};
    });
    // Form factor of a rectangle over a parallel point below one of its corners, for its four parts.
    double expected = 0;
    for (const double a : {0.6, 0.4}) {
      const double x = a / depth, y = 0.25 / depth, rx = std::sqrt(1 + x * x), ry = std::sqrt(1 + y * y);
      expected += 2 * 0.5 * (x / rx * std::atan(y / rx) + y / ry * std::atan(x / ry));
    }
    EXPECT_NEAR(e.mean, expected, 4 * e.standard_error) << depth;
    EXPECT_LT(e.standard_error, 0.01 * expected);
    EXPECT_LT(dark, total * 0.51) << "the half by area always passes";
  }
}

// The density that direct sampling reports is the one that is asked for later, and so is that of emission.
TEST(Portal, DensitiesAreThoseOfTheSamples) {
  const LightScene scene(window());
  const LightTable& lights = scene.lights();
  Random random(4);
  int lit = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3<float> at = scene.at(random.between(-1, 1), random.between(-1, 0.9), random.between(-1, 1));
    const auto d = sample_direct<float>(lights, at, 0, random.uniform(), random.uniform(), random.uniform());
    if (!(d.radiance.x > 0)) continue;
    ++lit;
    ASSERT_NEAR(direct_pdf_area<float>(lights, 0, at, d.wi, 1, 1) / d.pdf, 1, 1e-4);
    ASSERT_NEAR(emission_pdf<float>(lights, 0, at, d.wi, 1) / d.pdf_emission, 1, 1e-6);
  }
  EXPECT_GT(lit, 10000);
}

// Light paths start out of reach of the scene, lead through the rectangle, evenly over it, and bring pi A L.
TEST(Portal, LightPathsComeThroughTheRectangle) {
  const LightScene scene(window());
  const LightTable& lights = scene.lights();
  const Portal& portal = lights.portals.at(0);
  constexpr int kSamples = 100000;
  constexpr size_t kBins = 8;
  Random random(5);
  std::vector<double> observed(kBins * kBins), expected(kBins * kBins);
  const Estimate power = mean_of(kSamples, [&] {
    const auto e = sample_emission<float>(lights, 0, random.uniform(), random.uniform(), random.uniform(),
                                          random.uniform(), random.uniform());
    if (!(e.power.x > 0)) return 0.0;
    EXPECT_LT(e.direction.y, 0);
    EXPECT_NEAR(emission_pdf<float>(lights, 0, e.point, -e.direction, 1) / e.pdf, 1, 1e-3);
    const Vec3<float> c = e.point - Vec3<float>{scene.scene.bounds_center[0], scene.scene.bounds_center[1],
                                                scene.scene.bounds_center[2]};
    EXPECT_GT(std::sqrt(dot(c, c)), scene.scene.bounds_radius * 0.999f);
    const float t = (portal.corner.y - e.point.y) / e.direction.y;
    const Vec3<float> p =
        e.point + e.direction * t - Vec3<float>{portal.corner.x, portal.corner.y, portal.corner.z};
    const double a = double{p.x} / (1.0 * scene.scale), b = double{p.z} / (0.5 * scene.scale);
    EXPECT_GT(a, -1e-4);
    EXPECT_LT(a, 1 + 1e-4);
    const auto bin = [&](double x) {
      return std::min(static_cast<size_t>(std::max(x, 0.0) * kBins), kBins - 1);
    };
    ++observed[bin(a) * kBins + bin(b)];
    return double{e.power.x};
  });
  double drawn = 0;
  for (const double n : observed) drawn += n;
  for (double& x : expected) x = drawn / (kBins * kBins);
  EXPECT_TRUE(chi_square_passes(chi_square(observed, expected)));
  EXPECT_NEAR(power.mean, M_PI * double{portal.area}, 4 * power.standard_error);
  EXPECT_LT(power.standard_error, 0.01 * power.mean);
}

TEST(Portal, LanesHaveTheBitsOfScalars) {
  const LightScene scene(window());
  Random random(6);
  for (int round = 0; round < 1000; ++round) {
    Float8 x[5], at[3];
    for (Float8& f : x) {
      for (int l = 0; l < 8; ++l) f[l] = random.uniform();
    }
    for (Float8& f : at) {
      for (int l = 0; l < 8; ++l) f[l] = random.uniform();
    }
    const auto s = sample_direct<Float8>(scene.lights(), {at[0], at[1], at[2]}, x[0], x[1], x[2], x[3]);
    const auto e = sample_emission<Float8>(scene.lights(), x[0], x[1], x[2], x[3], x[4], x[0]);
    for (int l = 0; l < 8; ++l) {
      const auto t = sample_direct<float>(scene.lights(), {at[0][l], at[1][l], at[2][l]}, x[0][l], x[1][l],
                                          x[2][l], x[3][l]);
      ASSERT_EQ(float_bits(s.pdf[l]), float_bits(t.pdf));
      ASSERT_EQ(float_bits(s.wi.x[l]), float_bits(t.wi.x));
      ASSERT_EQ(float_bits(s.radiance.y[l]), float_bits(t.radiance.y));
      const auto f =
          sample_emission<float>(scene.lights(), x[0][l], x[1][l], x[2][l], x[3][l], x[4][l], x[0][l]);
      ASSERT_EQ(float_bits(e.point.z[l]), float_bits(f.point.z));
      ASSERT_EQ(float_bits(e.power.x[l]), float_bits(f.power.x));
      ASSERT_EQ(float_bits(e.pdf[l]), float_bits(f.pdf));
    }
  }
}

}  // namespace
}  // namespace lightmill::test
