// Oracles 7 to 10 and 12: a floor under a light of known irradiance.
#include <algorithm>
#include <cmath>

#include "tests/extreme/case.h"
#include "tests/statistical/oracles/form_factor.h"

namespace lightmill::test {
namespace {

constexpr double kRho = 0.5;
const Vec3d kUp{0, 1, 0};

/// A floor of 20 x 20, seen from above over about 2 x 2 units.
TestScene floor_scene() {
  TestScene s;
  s.quad({-10, 0, -10}, {0, 0, 20}, {20, 0, 0}, s.diffuse(static_cast<float>(kRho)));
  s.camera({0.5, 2, -1}, {0, 0, 0}, 50).film(16, 16);
  return s;
}

Setup floor_setup(const TestScene& s, const std::function<double(const Vec3d&)>& irradiance) {
  const double mean = mean_over_plane(
      s.scene, 0, [&](const Vec3d& p) { return kRho / M_PI * irradiance(p); }, 8);
  return {s.scene, 1, grey(mean), 1e-4};
}

Case point_over_plane(double height) {
  return {"7 point light over a plane", "h " + text(height), "rho I h / (pi (h^2 + x^2)^(3/2))",
          delta_light_sight(1, 1), [height] {
            TestScene s = floor_scene();
            s.point_light({0.3, height, 0.2}, {4, 4, 4});
            // The view shrinks with the height, so that it is always about the foot of the light.
            if (height < 1) s.camera({0.3 + 0.5 * height, 2 * height, 0.2 - height}, {0.3, 0, 0.2}, 50);
            return floor_setup(s, [height](const Vec3d& p) {
              const double d2 = std::pow(p.x - 0.3, 2) + std::pow(p.z - 0.2, 2) + height * height;
              return 4 * height / std::pow(d2, 1.5);
            });
          }};
}

/// Radiance so that the flux stays the same.
Case sphere_over_plane(double ratio) {
  return {"8 sphere light", "r/d " + text(ratio), "E = pi L (r/d)^2 cos", area_light_sight(1, 1), [ratio] {
            TestScene s = floor_scene();
            const double h = 1.2, r = double{static_cast<float>(ratio * h)};
            const auto emitted = static_cast<float>(1 / (ratio * ratio));
            // The sphere stays out of the picture: above it, or beside it where it is large.
            s.camera({1.5, 0.9, 0}, {0, 0, 0}, 40);
            if (ratio > 0.4) s.camera({2.5, 1.5, 0}, {2.8, 0, 0}, 60);
            s.sphere({0, h, 0}, r, s.diffuse(0), {.radiance = {emitted, emitted, emitted}});
            return floor_setup(s, [=](const Vec3d& p) {
              return M_PI * emitted * r * r * h / std::pow(p.x * p.x + p.z * p.z + h * h, 1.5);
            });
          }};
}

Case disk_over_plane(double radius, double height) {
  return {"9 coaxial disk", "R/d " + text(radius / height),
          "E = pi L R^2 / (R^2 + d^2), off the axis by Lambert's formula for its 64 sides",
          area_light_sight(1, 1), [radius, height] {
            constexpr int kSides = 64;
            TestScene s;
            s.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, s.diffuse(static_cast<float>(kRho)));
            const int black = s.diffuse(0);
            std::vector<Vec3d> rim;
            for (int i = 0; i < kSides; ++i) {
              const double a = 2 * M_PI * i / kSides;
              rim.push_back({radius * std::cos(a), height, radius * std::sin(a)});
            }
            const auto l = static_cast<float>(std::max(1.0, height * height / (radius * radius)));
            for (size_t i = 0; i < kSides; ++i)
              s.triangle({0, height, 0}, rim[i], rim[(i + 1) % kSides], black, {.radiance = {l, l, l}});
            s.camera({1.2 * height, 0.8 * height, 0}, {0, 0, 0}, 4).film(16, 16);
            return floor_setup(s, [=](const Vec3d& p) { return l * polygon_irradiance(rim, p, kUp); });
          }};
}

Case polygon_over_plane() {
  return {"10 polygon light", "tilted parallelogram", "Lambert: E = L/2 sum Theta_i (Gamma_i . n)",
          area_light_sight(1, 1), [] {
            TestScene s = floor_scene();
            const Vec3d a{-0.5, 0.8, -0.3}, u{0.9, 0.2, 0}, v{0, 0.1, 0.8};
            s.quad(a, u, v, s.diffuse(0), {.radiance = {3, 3, 3}});
            const std::vector<Vec3d> corners{a, a + u, a + u + v, a + v};
            s.camera({0.9, 0.6, -1.4}, {0, 0, 0}, 35);
            return floor_setup(s, [=](const Vec3d& p) { return 3 * polygon_irradiance(corners, p, kUp); });
          }};
}

/// A sphere as far away as its half-angle asks for; the floor's extent stays that of the view.
Case sun(double half_angle) {
  return {"12 sun disc, as a far sphere", "half-angle " + text(half_angle), "E = pi L sin^2(alpha) cos",
          without_lens(area_light_sight(1, 1)), [half_angle] {
            TestScene s;
            s.quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, s.diffuse(static_cast<float>(kRho)));
            s.camera({0.5, 2, -1}, {0, 0, 0}, 50).film(16, 16);
            constexpr double kDistance = 1e4;
            const Vec3d centre = normalized({0.3, 0.8, -0.4}) * kDistance;
            const double r = double{static_cast<float>(kDistance * std::sin(half_angle))};
            const auto l = static_cast<float>(std::pow(kDistance / r, 2));
            s.sphere(centre, r, s.diffuse(0), {.radiance = {l, l, l}});
            return floor_setup(s, [=](const Vec3d& p) {
              const Vec3d d = centre - p;
              return M_PI * l * r * r * d.y / std::pow(dot(d, d), 1.5);
            });
          }};
}

/// The distant light with an angle.
Case sun_disc(double half_angle) {
  return {"12 sun disc", "half-angle " + text(half_angle), "E = pi L sin^2(alpha) cos", far_light_sight(1, 1),
          [half_angle] {
            TestScene s;
            s.quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, s.diffuse(static_cast<float>(kRho)));
            s.camera({0.5, 2, -1}, {0, 0, 0}, 50).film(16, 16);
            const Vec3d to_sun = normalized({0.3, 0.8, -0.4});
            s.scene.lights.push_back({DistantLight{{1, 1, 1}, to_sun * -1, half_angle * 180 / M_PI}, {}});
            return floor_setup(s, [=](const Vec3d&) { return to_sun.y; });
          }};
}

/// Two lamps, one `ratio` times as bright, each in a channel of its own.
Case unequal_lamps(double ratio) {
  return {"lamps of unequal power", "1 to " + text(ratio), "8 for either: E = pi L (r/d)^2 cos",
          area_light_sight(1, 1), [ratio] {
            TestScene s = floor_scene();
            const int black = s.diffuse(0);
            const auto bright = static_cast<float>(ratio);
            s.sphere({0, 2.5, 0}, 1, black, {.radiance = {0, 1, 0}});
            s.sphere({4, 3, 0}, 1, black, {.radiance = {bright, 0, 1}});
            s.camera({0.5, 1, -1.5}, {0, 0, 0}, 40);
            const auto mean = [&](double x, double h) {
              return mean_over_plane(
                  s.scene, 0,
                  [=](const Vec3d& p) {
                    return kRho * h / std::pow(std::pow(p.x - x, 2) + p.z * p.z + h * h, 1.5);
                  },
                  8);
            };
            const double far = mean(4, 3);
            return Setup{s.scene, 1, {bright * far, mean(0, 2.5), far}, 1e-4};
          }};
}

}  // namespace

std::vector<Case> direct_light_cases() {
  std::vector<Case> cases{point_over_plane(1.5), point_over_plane(1e-2), point_over_plane(1e-4),
                          point_over_plane(1e-6)};
  cases[0].every_set = true;
  cases[3].notes.push_back(
      {Note::kKnown, 0, "a hit is known to 1e-7 of its triangle's size, here half the height of the light"});
  for (const double ratio : {1e-8, 1e-6, 1e-3, 0.1, 0.5, 0.99}) {
    cases.push_back(sphere_over_plane(ratio));
    if (ratio <= 1e-3)
      cases.back().notes.push_back(
          {Note::kSkip, kNextEvent | kLightTracing, "a sampled direction never meets so small a light"});
    cases.back().every_set = ratio == 0.1;
  }
  for (const double ratio : {1e-3, 0.7, 1e3}) {
    cases.push_back(disk_over_plane(ratio > 1 ? 0.5 : ratio, ratio > 1 ? 0.5 / ratio : 1));
    cases.back().sight = without_lens(cases.back().sight);
    if (ratio <= 1e-3)
      cases.back().notes.push_back(
          {Note::kSkip, kNextEvent, "a sampled direction all but never meets so small a light"});
    if (ratio >= 1e3)
      cases.back().notes.push_back({Note::kSkip, kEmissionHits,
                                    "points drawn on so near a disk alone all but never are the near ones"});
  }
  cases.push_back(polygon_over_plane());
  cases.back().every_set = true;
  for (const double alpha : {0.1, 1e-3, 1e-5}) {
    for (const auto& make : {sun, sun_disc}) {
      cases.push_back(make(alpha));
      if (alpha <= 1e-3) {
        // The view is too small for light paths of a far sphere. Those of the disc are sent towards the
        // scene.
        const Strategies finds = cases.back().sight.one & (kNextEvent | kLightTracing);
        cases.back().notes.push_back({Note::kSkip, finds, "a sampled direction all but never meets the sun"});
      }
    }
  }
  for (const double ratio : {1e3, 1e9}) cases.push_back(unequal_lamps(ratio));
  cases[cases.size() - 2].notes.push_back(
      {Note::kNoisy, kEmissionHits | kNextEvent, "one light path in a thousand leaves the dim lamp"});
  // Which channel a row shows is chance; of the dim lamp's, without hits, a mean at 1024 spp scatters by 4 %
  // and more.
  cases.back().notes.push_back(
      {Note::kNoisy, kEmissionHits,
       "what adds a billionth of the light mostly falls to roulette before its shadow ray"});
  return cases;
}

}  // namespace lightmill::test
