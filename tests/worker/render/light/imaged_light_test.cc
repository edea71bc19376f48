// Goniometric and projection lights: both directions of sampling, their densities and power, and what no
// image may hold.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/base/error.h"
#include "common/image/image.h"
#include "tests/support/temporary_folder.h"
#include "tests/worker/render/light/light_cases.h"

namespace lightmill::test {
namespace {

/// Texels of very different brightness, some black.
Image picture(int width, int height) {
  Image image(width, height);
  Random random(3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float v = (x + 3 * y) % 5 == 0 ? 0 : 0.1f + random.uniform() * random.uniform() * 20;
      float* p = image.pixel(x, y);
      p[0] = v, p[1] = 0.5f * v, p[2] = 0.25f * v;
    }
  }
  return image;
}

/// A turn about (1, 2, 3) and a place.
Transform somewhere() {
  const Vec3d a = normalized({1, 2, 3});
  const double c = std::cos(0.8), s = std::sin(0.8), k = 1 - c;
  Transform t;
  t.m = {{{c + a.x * a.x * k, a.x * a.y * k - a.z * s, a.x * a.z * k + a.y * s, 0.2},
          {a.y * a.x * k + a.z * s, c + a.y * a.y * k, a.y * a.z * k - a.x * s, 0.7},
          {a.z * a.x * k - a.y * s, a.z * a.y * k + a.x * s, c + a.z * a.z * k, -0.4},
          {0, 0, 0, 1}}};
  return t;
}

class Imaged : public ::testing::TestWithParam<bool> {
 protected:
  static bool projection() { return GetParam(); }
  /// One light of intensity scale (2, 1, 3) within a sphere.
  TestScene scene(const Image& image, double power = 0) const {
    write_image(image, folder_.file("light.exr"));
    TestScene s;
    s.sphere({0, 0, 0}, 3, s.diffuse(0.5f));
    const Rgb scale{2, 1, 3};
    if (projection()) {
      s.scene.lights.push_back(
          {ProjectionLight{scale, folder_.file("light.exr"), somewhere(), 70, power}, {"scene.pbrt", 4, 2}});
    } else {
      s.scene.lights.push_back(
          {GoniometricLight{scale, folder_.file("light.exr"), somewhere(), power}, {"scene.pbrt", 4, 2}});
    }
    return s;
  }
  TestScene scene(double power = 0) const {
    return scene(projection() ? picture(12, 5) : picture(8, 8), power);
  }
  TemporaryFolder folder_;
};

EmissionSample<float> emit_image(const LightTable& lights, Random& random) {
  const float t = random.uniform(), du = random.uniform(), dv = random.uniform();
  return sample_emission<float>(lights, 0, t, 0, 0, du, dv);
}

// chi^2 of emitted directions over z x phi of the world against their density, integrated on a fine grid.
TEST_P(Imaged, EmissionFollowsItsDensity) {
  const LightScene s(scene());
  constexpr size_t kZ = 24, kPhi = 48, kFine = 24;
  constexpr int kSamples = 200000;
  std::vector<double> observed(kZ * kPhi), expected(kZ * kPhi);
  double total = 0;
  for (size_t z = 0; z < kZ * kFine; ++z) {
    for (size_t phi = 0; phi < kPhi * kFine; ++phi) {
      const double c = (static_cast<double>(z) + 0.5) / double{kZ * kFine} * 2 - 1,
                   a = ((static_cast<double>(phi) + 0.5) / double{kPhi * kFine} * 2 - 1) * M_PI,
                   r = std::sqrt(1 - c * c);
      const Vec3<float> w{static_cast<float>(r * std::cos(a)), static_cast<float>(r * std::sin(a)),
                          static_cast<float>(c)};
      const double p = double{emission_pdf<float>(s.lights(), 0, {}, -w, 1)} * 4 * M_PI /
                       double{kZ * kFine * kPhi * kFine};
      expected[z / kFine * kPhi + phi / kFine] += p * kSamples;
      total += p;
    }
  }
  EXPECT_NEAR(total, 1, 2e-3);
  Random random(5);
  const auto bin = [](double x, size_t n) {
    return std::min(static_cast<size_t>(x * static_cast<double>(n)), n - 1);
  };
  for (int i = 0; i < kSamples; ++i) {
    const auto e = emit_image(s.lights(), random);
    ASSERT_TRUE(e.delta);
    ASSERT_FALSE(e.infinite);
    const double phi = std::atan2(double{e.direction.y}, double{e.direction.x}) / (2 * M_PI) + 0.5;
    ++observed[bin((double{e.direction.z} + 1) / 2, kZ) * kPhi + bin(phi, kPhi)];
  }
  // The grid's own error beside the noise: bins that the window or a texel's border cuts are known to 1 %.
  for (double& e : expected) e *= 1 / total;
  EXPECT_TRUE(chi_square_passes(chi_square(observed, expected, 50), 2, 1e-4));
}

// power = intensity / density on every path; its mean is the light's power.
TEST_P(Imaged, PathsCarryThePower) {
  const LightScene s(scene());
  Random random(7);
  const Estimate e = mean_of(64000, [&] {
    const auto x = emit_image(s.lights(), random);
    return (double{x.power.x} + x.power.y + x.power.z) / 3;
  });
  EXPECT_TRUE(
      mean_is(e, s.lights().total_power, {.resolution = 0.01, .rounding = projection() ? 0.02 : 1e-4}));
}

// What direct sampling reports towards a point is what emission into that direction carries.
TEST_P(Imaged, BothDirectionsSeeTheSameIntensity) {
  const LightScene s(scene());
  Random random(9);
  int lit = 0, dark = 0, disagree = 0;
  for (int i = 0; i < 20000; ++i) {
    const auto e = emit_image(s.lights(), random);
    const Vec3<float> at = e.point + e.direction * 0.125f;
    const auto d = sample_direct<float>(s.lights(), at, 0, 0, random.uniform(), random.uniform());
    ASSERT_TRUE(d.delta);
    ASSERT_NEAR(d.pdf / d.distance2, 1, 1e-5);
    // Up to rounding at a texel's border.
    if (std::fabs(d.radiance.x - e.power.x * e.pdf) > 1e-3f * d.radiance.x ||
        std::fabs(d.pdf_emission - e.pdf) > 1e-3f * e.pdf) {
      ++disagree;
    }
    // And from anywhere: the inverse direction's intensity is 0 where nothing is emitted.
    const Vec3<float> w = square_to_sphere(random.uniform(), random.uniform());
    const auto back = sample_direct<float>(s.lights(), e.point + w * 0.125f, 0, 0, 0, 0);
    ++(back.radiance.x > 0 ? lit : dark);
    ASSERT_EQ(back.radiance.x > 0, back.pdf_emission > 0);
  }
  EXPECT_LT(disagree, 40);
  EXPECT_GT(lit, 1000);
  EXPECT_GT(dark, 1000);
}

TEST_P(Imaged, PowerReplacesTheMagnitude) {
  Image grey(8, 8);
  for (float& x : grey.data) x = 0.3f;
  const LightScene s(scene(grey, 50));
  // Of the image alone: I or the scale multiplies it, its mean channel being 2.
  EXPECT_NEAR(s.lights().total_power / (s.scale * s.scale), 2 * 50, 0.02);
}

TEST_P(Imaged, LanesHaveTheBitsOfScalars) {
  const LightScene s(scene());
  Random random(12);
  for (int round = 0; round < 2000; ++round) {
    Float8 t, u, v;
    Vec3<Float8> p;
    for (int l = 0; l < 8; ++l) {
      t[l] = random.uniform(), u[l] = random.uniform(), v[l] = random.uniform();
      p.x[l] = static_cast<float>(random.between(-1, 1)), p.y[l] = static_cast<float>(random.between(-1, 1));
      p.z[l] = static_cast<float>(random.between(-1, 1));
    }
    const auto e = sample_emission<Float8>(s.lights(), Float8{}, t, Float8{}, Float8{}, u, v);
    const auto d = sample_direct<Float8>(s.lights(), p, Float8{}, t, u, v);
    for (int l = 0; l < 8; ++l) {
      const auto f = sample_emission<float>(s.lights(), 0, t[l], 0, 0, u[l], v[l]);
      ASSERT_EQ(float_bits(e.direction.x[l]), float_bits(f.direction.x));
      ASSERT_EQ(float_bits(e.power.y[l]), float_bits(f.power.y));
      ASSERT_EQ(float_bits(e.pdf[l]), float_bits(f.pdf));
      const auto g = sample_direct<float>(s.lights(), {p.x[l], p.y[l], p.z[l]}, 0, t[l], u[l], v[l]);
      ASSERT_EQ(float_bits(d.radiance.z[l]), float_bits(g.radiance.z));
      ASSERT_EQ(float_bits(d.pdf_emission[l]), float_bits(g.pdf_emission));
    }
  }
}

TEST_P(Imaged, RefusesWhatIsNoIntensity) {
  const std::pair<float, const char*> bad[] = {
      {NAN, "not a number"}, {INFINITY, "infinite"}, {-1.0f, "negative"}};
  for (const auto& [value, word] : bad) {
    Image image(4, 4);
    std::ranges::fill(image.data, 1.0f);
    image.data[3 * 6 + 1] = value;
    try {
      build_scene(scene(image).scene);
      FAIL() << word;
    } catch (const Error& e) {
      const std::string message = e.what();
      EXPECT_EQ(message.rfind("scene.pbrt:4:2: ", 0), 0u) << message;
      EXPECT_NE(message.find(word), std::string::npos) << message;
    }
  }
}

TEST_P(Imaged, BlackOnesAreLeftOut) {
  Image image(4, 4);
  std::ranges::fill(image.data, 0.0f);
  const RenderScene built = build_scene(scene(image).scene);
  EXPECT_EQ(built.lights.count(), 0);
  ASSERT_EQ(built.warnings.size(), 2u);
  EXPECT_EQ(built.warnings[0].where.line, 4);
  EXPECT_NE(built.warnings[0].message.find("black"), std::string::npos);
  EXPECT_NE(built.warnings[1].message.find("the picture will be black"), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(Lights, Imaged, ::testing::Bool(),
                         [](const auto& info) { return info.param ? "projection" : "goniometric"; });

// pbrt's conventions: the picture's top is at +y of the light, its left at -x; the middle of a goniometric
// image is the light's +y.
TEST(ImagedOrientation, IsPbrts) {
  const TemporaryFolder folder;
  Image corner(2, 2);
  corner.pixel(0, 0)[0] = corner.pixel(0, 0)[1] = corner.pixel(0, 0)[2] = 1;
  write_image(corner, folder.file("corner.exr"));
  TestScene p;
  p.sphere({0, 0, 0}, 3, p.diffuse(0.5f));
  p.scene.lights.push_back({ProjectionLight{{1, 1, 1}, folder.file("corner.exr"), {}, 90, 0}, {}});
  const LightScene s(p);
  const auto lit = [&](double x, double y, double z) {
    return sample_direct<float>(s.lights(), s.at(x, y, z), 0, 0, 0, 0).radiance.x > 0;
  };
  EXPECT_TRUE(lit(-0.5, 0.5, 1));
  EXPECT_FALSE(lit(0.5, 0.5, 1));
  EXPECT_FALSE(lit(-0.5, -0.5, 1));
  EXPECT_FALSE(lit(-1.1, 0.5, 1));  // beside the window
  EXPECT_FALSE(lit(0.5, -0.5, -1));

  Image middle(8, 8);
  for (int y = 3; y < 5; ++y) {
    for (int x = 3; x < 5; ++x) middle.pixel(x, y)[0] = 3;
  }
  write_image(middle, folder.file("middle.exr"));
  TestScene g;
  g.sphere({0, 0, 0}, 3, g.diffuse(0.5f));
  g.scene.lights.push_back({GoniometricLight{{1, 2, 1}, folder.file("middle.exr"), {}, 0}, {}});
  const LightScene t(g);
  const auto up = sample_direct<float>(t.lights(), t.at(0, 1, 0), 0, 0, 0, 0).radiance;
  EXPECT_NEAR(up.x / (t.scale * t.scale), 1, 1e-6);  // a grey of the three channels' mean
  EXPECT_NEAR(up.y, 2 * up.x, 1e-6);
  EXPECT_EQ(sample_direct<float>(t.lights(), t.at(0, -1, 0), 0, 0, 0, 0).radiance.x, 0);
  EXPECT_EQ(sample_direct<float>(t.lights(), t.at(0, 0, 1), 0, 0, 0, 0).radiance.x, 0);
}

}  // namespace
}  // namespace lightmill::test
