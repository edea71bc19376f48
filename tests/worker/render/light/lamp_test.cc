// Lamps without a surface: their power, the irradiance below them, and that what is sampled is what rays
// meet.
#include "worker/render/light/lamp.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/worker/render/light/light_cases.h"

namespace lightmill::test {
namespace {

/// The lamp shines down from (0, 2, 0); the camera at the origin makes lengths keep their scale's power of
/// two.
AreaLamp area_lamp(bool ellipse, double width, double height, double spread = 180) {
  AreaLamp lamp{{3, 2, 1}};
  lamp.light_to_world = translation({0, 2, 0}) * rotation(-90, {1, 0, 0});  // -z goes to -y
  lamp.ellipse = ellipse;
  lamp.half_width = width / 2;
  lamp.half_height = height / 2;
  lamp.spread_degrees = spread;
  return lamp;
}
SpotLight soft_spot() {
  SpotLight spot{{3, 2, 1}, {0, 2, 0}, {0, -1, 0}, 20, 50};
  spot.falls_as_cosine = true;
  spot.radius = 0.4;
  return spot;
}
LightScene with(LightKind light) {
  TestScene s;
  s.quad({-3, -1, -3}, {0, 0, 6}, {6, 0, 0}, s.diffuse(0.5f));
  s.scene.lights.push_back({std::move(light), {}});
  return LightScene(s);
}
const std::vector<std::pair<const char*, LightKind>>& all_lamps() {
  static const std::vector<std::pair<const char*, LightKind>> lamps = {
      {"rectangle", area_lamp(false, 1.5, 0.5)},
      {"ellipse", area_lamp(true, 1.5, 0.5)},
      {"spread", area_lamp(false, 1.5, 0.5, 60)},
      {"point", PointLight{{3, 2, 1}, {0, 2, 0}, 0.4}},
      {"spot", soft_spot()}};
  return lamps;
}

/// Irradiance on a surface at `p` with normal +y, of the first channel, by next-event estimation.
Estimate irradiance(const LightScene& scene, const Vec3<float>& p) {
  Random random(3);
  return mean_of(1 << 17, [&] {
    const auto s = sample_direct<float>(scene.lights(), p, 0, 0, random.uniform(), random.uniform());
    return s.pdf > 0 ? double{s.radiance.x} * std::max(s.wi.y, 0.0f) / double{s.pdf} : 0;
  });
}

// A disk of radius r, parallel to the surface, h above and a beside it: E = pi L / 2 (1 - (h^2 + a^2 - r^2) /
// sqrt((h^2 + a^2 + r^2)^2 - 4 a^2 r^2)).
TEST(Lamp, IrradianceBelowADisk) {
  const LightScene scene = with(area_lamp(true, 1.6, 1.6));
  for (const double a : {0.0, 0.5, 1.5}) {
    const double h = 2.5, r = 0.8, d2 = h * h + a * a;
    const double expected =
        M_PI * 3 / 2 * (1 - (d2 - r * r) / std::sqrt((d2 + r * r) * (d2 + r * r) - 4 * a * a * r * r));
    const Estimate e = irradiance(scene, scene.at(a, -0.5, 0));
    EXPECT_NEAR(e.mean / expected, 1, 5 * e.standard_error / expected + 1e-4) << a;
  }
}

// A disk that faces the point: its cone has the half angle atan(r / d), so E = I cos / (d^2 + r^2).
TEST(Lamp, IrradianceOfALampThatFacesThePoint) {
  const LightScene scene = with(PointLight{{3, 2, 1}, {0, 2, 0}, 0.4});
  for (const double a : {0.0, 0.5, 1.5}) {
    const double d2 = 1 + a * a;
    const double expected = 3 / (d2 + 0.16) / std::sqrt(d2);
    const Estimate e = irradiance(scene, scene.at(a, 1, 0));
    EXPECT_NEAR(e.mean / expected, 1, 5 * e.standard_error / expected + 1e-4) << a;
  }
}

// Cycles' spot: I times the integral of cos smoothstep over its cone. A spread keeps pi L A.
TEST(Lamp, LightPathsCarryThePower) {
  const auto power_of = [](const LightScene& scene) {
    Random random(5);
    const Estimate e = mean_of(1 << 17, [&] {
      const float pu = random.uniform(), pv = random.uniform(), du = random.uniform(), dv = random.uniform();
      return double{sample_emission<float>(scene.lights(), 0, 0, pu, pv, du, dv).power.x};
    });
    return std::pair(e.mean / (scene.scale * scene.scale), e.standard_error / (scene.scale * scene.scale));
  };
  const double start = std::cos(20 * M_PI / 180), end = std::cos(50 * M_PI / 180);
  double spot = 0;
  constexpr int kSteps = 100000;
  for (int i = 0; i < kSteps; ++i) {
    const double c = end + (1 - end) * (i + 0.5) / kSteps;
    const double t = std::min((c - end) / (start - end), 1.0);
    spot += 2 * M_PI * 3 * c * t * t * (3 - 2 * t) * (1 - end) / kSteps;
  }
  const double expected[] = {M_PI * 3 * 0.75, M_PI * 3 * 0.75 * M_PI / 4, M_PI * 3 * 0.75, 4 * M_PI * 3,
                             spot};
  for (size_t i = 0; i < all_lamps().size(); ++i) {
    const LightScene scene = with(all_lamps()[i].second);
    const auto [mean, error] = power_of(scene);
    EXPECT_NEAR(mean / expected[i], 1, 5 * error / expected[i] + 1e-5) << all_lamps()[i].first;
    EXPECT_NEAR(scene.lights().total_power / (scene.scale * scene.scale) / (expected[i] * 2 / 3), 1, 1e-4)
        << all_lamps()[i].first << ": the power that decides how often it is drawn";
  }
}

// What light paths carry through a square of a plane is the irradiance there times its area.
TEST(Lamp, LightPathsBringTheIrradiance) {
  for (const auto& [name, kind] : all_lamps()) {
    const LightScene scene = with(kind);
    const Vec3<float> p = scene.at(0.4, 0.8, 0.3);
    const auto half = static_cast<float>(0.1 * scene.scale);
    Random random(11);
    const Estimate by_paths = mean_of(1 << 21, [&] {
      const float pu = random.uniform(), pv = random.uniform(), du = random.uniform(), dv = random.uniform();
      const auto e = sample_emission<float>(scene.lights(), 0, 0, pu, pv, du, dv);
      EXPECT_NEAR(dot(e.direction, e.direction), 1, 1e-5);
      if (!(e.direction.y < 0)) return 0.0;
      const Vec3<float> at = e.point + e.direction * ((p.y - e.point.y) / e.direction.y);
      if (std::fabs(at.x - p.x) > half || std::fabs(at.z - p.z) > half) return 0.0;
      if (!in_facing_cones<float>(scene.lights(), 0, at, -e.direction, 0.0f)) return 0.0;
      return double{e.power.x} / (4 * half * half);
    });
    const Estimate by_lights = irradiance(scene, p);
    EXPECT_NEAR(
        by_paths.mean / by_lights.mean, 1,
        5 * by_paths.standard_error / by_lights.mean + 5 * by_lights.standard_error / by_lights.mean + 3e-3)
        << name;
    EXPECT_LT(by_paths.standard_error / by_lights.mean, 0.02) << name << ": the test notices little";
  }
}

// What is sampled is met, from everywhere; what rays meet has the density of sampling: the integral of the
// radiance over all directions that meet the lamp is that by sampling.
TEST(Lamp, RaysMeetWhatIsSampled) {
  for (const auto& [name, kind] : all_lamps()) {
    const LightScene scene = with(kind);
    ASSERT_EQ(scene.lights().lamps.size(), 1u) << name;
    const LightRecord<float> r(scene.lights(), 0);
    const LightType type = scene.lights().type[0];
    Random random(7);
    int missed = 0;
    constexpr int kSamples = 20000;
    for (int i = 0; i < kSamples; ++i) {
      const Vec3<float> p = scene.at(random.between(-2, 2), random.between(-0.9, 1.9), random.between(-2, 2));
      const auto s = sample_direct<float>(scene.lights(), p, 0, 0, random.uniform(), random.uniform());
      if (!(max_component(s.radiance) > 0)) continue;
      const LampHit<float> hit = meet_lamp<float>(r, type, p, s.wi);
      if (!hit.met) {
        ++missed;  // at the edge, by rounding
        continue;
      }
      ASSERT_NEAR(hit.distance * hit.distance / s.distance2, 1, 1e-3) << name;
      ASSERT_NEAR(hit.radiance.x / s.radiance.x, 1, 5e-2) << name;
      const float pdf = direct_pdf_area<float>(scene.lights(), 0, p, s.wi, s.distance2, s.cos_light) *
                        (type == kFacingLamp ? 1 : s.distance2 / s.cos_light);
      ASSERT_NEAR(pdf / s.pdf, 1, 1e-2) << name;
    }
    EXPECT_LT(missed, kSamples / 500) << name;
  }
}

// A lamp that paths do not count is a delta light.
TEST(Lamp, WithoutHitsItIsADeltaLight) {
  LightScene scene = with(area_lamp(false, 1, 1));
  LightTable lights = scene.lights();
  EXPECT_FALSE(sample_direct<float>(lights, scene.at(0, 0, 0), 0, 0, 0.5f, 0.5f).delta);
  lights.lamps.clear();
  EXPECT_TRUE(sample_direct<float>(lights, scene.at(0, 0, 0), 0, 0, 0.5f, 0.5f).delta);
  EXPECT_TRUE(sample_emission<float>(lights, 0, 0, 0.5f, 0.5f, 0.5f, 0.5f).delta);
}

}  // namespace
}  // namespace lightmill::test
