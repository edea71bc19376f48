// Direct light sampling: chi^2 over a sphere's cone and over triangles, densities that integrate to one,
// equal bits in lanes.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/worker/render/light/light_cases.h"

namespace lightmill::test {
namespace {

constexpr int kSamples = 100000;
constexpr size_t kBins = 16;

size_t bin(double x) { return std::min(static_cast<size_t>(std::max(x, 0.0) * kBins), kBins - 1); }

// Directions are uniform in the cone (area measure in (1 - cos) x phi); the density is 1 / its solid angle.
TEST(DirectSampling, SphereConeIsUniform) {
  const double ratios[] = {1e-6, 1e-3, 0.1, 0.7, 0.99};
  for (const double ratio : ratios) {
    const double d = 3;
    const LightScene scene(sphere_light(ratio * d, d));
    const double sin2_max = ratio * ratio, q_max = sin2_max / (1 + std::sqrt(1 - sin2_max));
    Random random(5);
    std::vector<double> observed(kBins * kBins), expected(kBins * kBins, double{kSamples} / (kBins * kBins));
    const bool resolved = ratio > 1e-4;  // below, the rounding of wi itself is as large as the cone's bins
    for (int i = 0; i < kSamples; ++i) {
      const auto s = sample_direct<float>(scene.lights(), {}, 0, 0, random.uniform(), random.uniform());
      const double sin2 = double{s.wi.x} * s.wi.x + double{s.wi.y} * s.wi.y;
      ASSERT_LE(std::sqrt(sin2), ratio * 1.001 + 3e-8) << ratio;
      if (resolved) {
        const double q = sin2 / (1 + std::sqrt(std::max(0.0, 1 - sin2)));
        ++observed[bin(q / q_max) * kBins + bin(std::atan2(s.wi.y, s.wi.x) / (2 * M_PI) + 0.5)];
      }
      if (s.cos_light >
          0.05f) {  // the density is formed from the point; near the rim its cosine is ill-conditioned
        ASSERT_NEAR(s.pdf * 2 * M_PI * q_max, 1, 2e-3) << ratio;
        ASSERT_EQ(s.radiance.x, 1.0f);
      }
    }
    if (resolved) {
      EXPECT_TRUE(chi_square_passes(chi_square(observed, expected), 4)) << ratio;
    }
  }
}

TEST(DirectSampling, SphereFromInsideIsUniformOverItsArea) {
  TestScene s;
  s.sphere({0, 0, 0.3}, 1, s.diffuse(0), {.radiance = {1, 1, 1}, .inward = true});
  const LightScene scene(s);
  Random random(6);
  std::vector<double> observed(kBins * kBins), expected(kBins * kBins, double{kSamples} / (kBins * kBins));
  for (int i = 0; i < kSamples; ++i) {
    const auto d = sample_direct<float>(scene.lights(), {}, 0, 0, random.uniform(), random.uniform());
    const Vec3<float> n = -d.normal;
    ++observed[bin(0.5 + 0.5 * n.z) * kBins + bin(std::atan2(n.y, n.x) / (2 * M_PI) + 0.5)];
    ASSERT_EQ(d.radiance.x, 1.0f);
  }
  EXPECT_TRUE(chi_square_passes(chi_square(observed, expected)));
}

TEST(DirectSampling, TrianglePointsAreUniform) {
  const LightScene scene(triangle_light());
  const LightRecord<float> r(scene.lights(), 0);
  const Vec3<float> v0 = r.vec(kLightP), e1 = r.vec(kLightE1), e2 = r.vec(kLightE2);
  const float a11 = dot(e1, e1), a12 = dot(e1, e2), a22 = dot(e2, e2), det = a11 * a22 - a12 * a12;
  Random random(8);
  std::vector<double> observed(kBins * kBins), expected(kBins * kBins, double{kSamples} / (kBins * kBins));
  for (int i = 0; i < kSamples; ++i) {
    const auto s = sample_direct<float>(scene.lights(), {}, 0, 0, random.uniform(), random.uniform());
    const Vec3<float> p = s.point - v0;
    const double x = dot(p, e1), y = dot(p, e2);
    const double b1 = (x * a22 - y * a12) / det, b2 = (y * a11 - x * a12) / det, rest = 1 - b1;
    ++observed[bin(1 - rest * rest) * kBins + bin(b2 / std::max(rest, 1e-6))];
    const double area = std::sqrt(double{det}) / 2;
    ASSERT_NEAR(s.pdf / (s.distance2 / (s.cos_light * area)), 1, 1e-4);
    ASSERT_NEAR(s.cos_light, std::fabs(dot(s.wi, s.normal)), 1e-6);
  }
  EXPECT_TRUE(chi_square_passes(chi_square(observed, expected)));
}

/// Ray against the lights of a scene without geometry but theirs; distance^2, cosine, or a miss.
struct LightHit {
  bool hit = false;
  double distance2 = 0, cosine = 0;
};
LightHit hit_triangle(const LightRecord<float>& r, const Vec3<float>& w) {
  const auto f = [&](int s) { return Vec3d{r.scalar(s), r.scalar(s + 1), r.scalar(s + 2)}; };
  const Vec3d p = f(kLightP), e1 = f(kLightE1), e2 = f(kLightE2), d{w.x, w.y, w.z};
  const Vec3d n = cross(e1, e2);
  const double det = -dot(d, n);
  const Vec3d o = p * -1.0, c = cross(o, d);
  const double t = dot(o, n) / det, u = dot(e2, c) / det, v = -dot(e1, c) / det;
  if (!(t > 0) || u < 0 || v < 0 || u + v > 1) return {};
  return {true, t * t, std::fabs(dot(d, n)) / length(n)};
}
LightHit hit_sphere(const LightRecord<float>& r, const Vec3<float>& w) {
  const Vec3d c{r.scalar(0), r.scalar(1), r.scalar(2)}, d{w.x, w.y, w.z};
  const double radius = r.scalar(3), b = dot(c, d), disc = b * b - dot(c, c) + radius * radius;
  if (disc < 0 || b < 0) return {};
  const double t = b - std::sqrt(disc);
  return {true, t * t, std::fabs(dot(normalized(d * t - c), d))};
}

// A sun's directions are uniform in its cone, at any half angle, and count as inside when asked for again.
TEST(DirectSampling, SunIsUniformInItsCone) {
  for (const double alpha : {1e-6, 1e-5, 1e-3, 0.2, 1.2}) {
    TestScene t;
    const Vec3d along = normalized({0.2, -0.7, 0.4});
    DistantLight sun{{1, 1, 1}, along};
    sun.half_angle_degrees = alpha * 180 / M_PI;
    t.scene.lights.push_back({sun, {}});
    const LightScene scene(t);
    const LightTable& lights = scene.lights();
    const double half = std::sin(alpha / 2), solid = 4 * M_PI * half * half;
    Random random(15);
    constexpr size_t kRings = 16;
    std::vector<double> observed(kRings), expected(kRings, double{kSamples} / kRings);
    for (int i = 0; i < kSamples; ++i) {
      const auto d = sample_direct<float>(lights, {}, 0, 0, random.uniform(), random.uniform());
      ASSERT_NEAR(d.pdf * solid, 1, 1e-4);
      ASSERT_EQ(direct_pdf_area<float>(lights, 0, {}, d.wi, 1, 1), d.pdf);
      const auto e = sample_emission<float>(lights, 0, 0, random.uniform(), random.uniform(),
                                            random.uniform(), random.uniform());
      ASSERT_GT(e.pdf, 0);
      const Vec3d chord{d.wi.x + along.x, d.wi.y + along.y, d.wi.z + along.z};
      const double q = dot(chord, chord) / (4 * half * half);
      ++observed[std::min(static_cast<size_t>(q * kRings), kRings - 1)];
    }
    // Below 1e-3 the rounding of directions shows in rings of equal area.
    if (alpha >= 1e-3) {
      EXPECT_TRUE(chi_square_passes(chi_square(observed, expected), 3)) << alpha;
    }
  }
}

// What MIS asks of a direction that was *not* sampled here: the density integrates to one over
// all directions.
TEST(DirectSampling, DensityIntegratesToOne) {
  Random random(9);
  const LightScene triangle(triangle_light());
  const LightRecord<float> rt(triangle.lights(), 0);
  const Estimate t = mean_of(640000, [&] {
    const Vec3<float> w = square_to_sphere(random.uniform(), random.uniform());
    const LightHit h = hit_triangle(rt, w);
    if (!h.hit) return 0.0;
    const auto d2 = static_cast<float>(h.distance2), c = static_cast<float>(h.cosine);
    return 4 * M_PI * direct_pdf_area<float>(triangle.lights(), 0, {}, {}, d2, c) * h.distance2 / h.cosine;
  });
  EXPECT_TRUE(mean_is(t, 1, {.resolution = 0.03}));
  const LightScene sphere(sphere_light(1, 2));
  const LightRecord<float> rs(sphere.lights(), 0);
  const Estimate e = mean_of(640000, [&] {
    const Vec3<float> w = square_to_sphere(random.uniform(), random.uniform());
    const LightHit h = hit_sphere(rs, w);
    if (!h.hit || h.cosine < 1e-4) return 0.0;
    const auto d2 = static_cast<float>(h.distance2), c = static_cast<float>(h.cosine);
    return 4 * M_PI * direct_pdf_area<float>(sphere.lights(), 0, {}, {}, d2, c) * h.distance2 / h.cosine;
  });
  EXPECT_TRUE(mean_is(e, 1, {.resolution = 0.03}));
}

// The estimate of irradiance: sphere lights by pi L (r / d)^2 cos, path by path constant up to the cosine.
TEST(DirectSampling, IrradianceOfASphereLight) {
  for (const double ratio : {1e-6, 1e-3, 0.1, 0.9}) {
    const LightScene scene(sphere_light(ratio * 2, 2));
    Random random(10);
    const Estimate e = mean_of(64000, [&] {
      const auto s = sample_direct<float>(scene.lights(), {}, 0, 0, random.uniform(), random.uniform());
      return s.pdf > 0 ? double{s.radiance.x} * s.wi.z / s.pdf : 0.0;
    });
    EXPECT_TRUE(mean_is(e, M_PI * ratio * ratio, {.resolution = 0.01, .rounding = 1e-3})) << ratio;
  }
}

TEST(DirectSampling, DarkSidesGiveNothing) {
  for (const bool two_sided : {false, true}) {
    const LightScene scene(triangle_light(two_sided));
    int lit = 0;
    // Above and below the triangle.
    for (const double y : {-1.0, 1.9}) {
      const auto s = sample_direct<float>(scene.lights(), scene.at(0.1, y, 0.2), 0, 0, 0.4f, 0.3f);
      lit += s.radiance.x > 0;
      EXPECT_GT(s.pdf, 0);
    }
    EXPECT_EQ(lit, two_sided ? 2 : 1);
  }
}

TEST(DirectSampling, PointLightByTheInverseSquare) {
  TestScene s;
  s.point_light({0, 0, 2}, {3, 2, 1});
  const LightScene scene(s);
  for (const double z : {1.0, 0.0, -5.0}) {
    const auto d = sample_direct<float>(scene.lights(), scene.at(0, 0, z), 0, 0, 0.1f, 0.2f);
    EXPECT_TRUE(d.delta);
    EXPECT_NEAR(d.radiance.x / d.pdf, 3 / ((2 - z) * (2 - z)), 1e-5);  // W/m^2 at the point, in any scale
    EXPECT_NEAR(d.wi.z, 1, 1e-6);
  }
}

TEST(DirectSampling, LanesHaveTheBitsOfScalars) {
  const LightScene scene(mixed_lights());
  Random random(12);
  for (int round = 0; round < 3000; ++round) {
    Vec3<Float8> p;
    Float8 pick{}, u{}, v{};
    for (int l = 0; l < 8; ++l) {
      p.x[l] = static_cast<float>(random.between(-1, 1)), p.y[l] = static_cast<float>(random.between(-1, 1));
      p.z[l] = static_cast<float>(random.between(-1, 1));
      pick[l] = random.uniform(), u[l] = random.uniform(), v[l] = random.uniform();
    }
    const auto s = sample_direct<Float8>(scene.lights(), p, pick, Float8{}, u, v);
    for (int l = 0; l < 8; ++l) {
      const auto t = sample_direct<float>(scene.lights(), {p.x[l], p.y[l], p.z[l]}, pick[l], 0, u[l], v[l]);
      ASSERT_EQ(float_bits(s.wi.x[l]), float_bits(t.wi.x));
      ASSERT_EQ(float_bits(s.wi.z[l]), float_bits(t.wi.z));
      ASSERT_EQ(float_bits(s.radiance.x[l]), float_bits(t.radiance.x));
      ASSERT_EQ(float_bits(s.pdf[l]), float_bits(t.pdf));
      ASSERT_EQ(float_bits(s.pdf_emission[l]), float_bits(t.pdf_emission));
      ASSERT_EQ(float_bits(s.cos_light[l]), float_bits(t.cos_light));
      ASSERT_EQ(s.delta[l] != 0, t.delta);
      ASSERT_EQ(s.infinite[l] != 0, t.infinite);
    }
  }
}

}  // namespace
}  // namespace lightmill::test
