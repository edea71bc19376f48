// Oracle 11, and lights that touch what they light: a corner, a sphere tangent to the floor, slits.
#include <cmath>

#include "tests/extreme/case.h"
#include "tests/statistical/oracles/form_factor.h"

namespace lightmill::test {
namespace {

constexpr double kRho = 0.5;
const Vec3d kUp{0, 1, 0};

/// The floor at x from an emitting wall of height 1/2 that stands on it; the finite wall by
/// Lambert's formula.
Case corner(double x) {
  Case c{
      "11 corner beside an emitting strip", "x " + text(x), "E = pi L / 2 (1 - x / sqrt(x^2 + h^2))",
      without_lens(area_light_sight(1, 1)), [x] {
        TestScene s;
        constexpr double kLength = 50, kHeight = 0.5;
        s.quad({0, 0, -kLength}, {0, 0, 2 * kLength}, {kLength, 0, 0}, s.diffuse(static_cast<float>(kRho)));
        s.quad({0, 0, -kLength}, {0, kHeight, 0}, {0, 0, 2 * kLength}, s.diffuse(0), {.radiance = {1, 1, 1}});
        // The view is half of x wide, from as far as keeps its angle above float's resolution.
        const double away = std::min(1.0, 1e3 * x);
        s.camera({x + away, 0.8 * away, 0}, {x, 0, 0}, std::min(20.0, 0.3 * x / away * 180 / M_PI));
        s.film(16, 16);
        const std::vector<Vec3d> wall{
            {0, 0, -kLength}, {0, kHeight, -kLength}, {0, kHeight, kLength}, {0, 0, kLength}};
        const double mean = mean_over_plane(
            s.scene, 0, [&](const Vec3d& p) { return kRho / M_PI * polygon_irradiance(wall, p, kUp); }, 4);
        return Setup{s.scene, 1, grey(mean), 1e-4};
      }};
  c.notes.push_back(
      {Note::kSkip, kEmissionHits,
       "points drawn on the wall alone have a variance that grows without bound towards the corner"});
  return c;
}

/// A sphere light that touches the floor at the origin, seen at `x` from the point of contact.
Case tangent_sphere(double x) {
  Case c{"8 sphere light that touches the floor", "x/r " + text(x), "E = pi L (r/d)^2 cos, r = h",
         without_lens(area_light_sight(1, 1)), [x] {
           TestScene s;
           s.quad({-10, 0, -10}, {0, 0, 20}, {20, 0, 0}, s.diffuse(static_cast<float>(kRho)));
           s.sphere({0, 1, 0}, 1, s.diffuse(0), {.radiance = {1, 1, 1}});
           // Below the belly, along the floor: the sphere is x^2 / 2 above it there.
           const double up = x * x / 8;
           s.camera({2 * x, up, 0}, {x, 0, 0}, 0.2 * up / x * 180 / M_PI).film(16, 16);
           const double mean = mean_over_plane(
               s.scene, 0, [](const Vec3d& p) { return kRho / std::pow(p.x * p.x + p.z * p.z + 1, 1.5); }, 4);
           return Setup{s.scene, 1, grey(mean), 2e-4};
         }};
  return c;
}

/// An emitting panel of 2 x 2 at a gap in front of a black wall of 8 x 8, over a floor: the wall behind must
/// not shadow it.
Case panel_before_wall(double gap) {
  return {"near-coincident light and wall", "gap " + text(gap), "Lambert's formula of the panel alone",
          area_light_sight(1, 1), [gap] {
            TestScene s;
            s.quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, s.diffuse(static_cast<float>(kRho)));
            const int black = s.diffuse(0);
            s.quad({-4, 1, -4}, {8, 0, 0}, {0, 0, 8}, black);
            const Vec3d a{-1, 1 - gap, -1}, u{2, 0, 0}, v{0, 0, 2};
            s.quad(a, u, v, black, {.radiance = {2, 2, 2}});
            s.camera({0.5, 0.9, -1.5}, {0, 0, 0.3}, 40).film(16, 16);
            const double y = double{static_cast<float>(1 - gap)};
            const std::vector<Vec3d> panel{{-1, y, -1}, {1, y, -1}, {1, y, 1}, {-1, y, 1}};
            const double mean = mean_over_plane(
                s.scene, 0,
                [&](const Vec3d& p) { return kRho / M_PI * 2 * polygon_irradiance(panel, p, kUp); }, 8);
            return Setup{s.scene, 1, grey(mean), 1e-4};
          }};
}

/// A slit of 1 x w over the floor in the camera's plane z = 0, as bright as 1/w.
Case slit(double width) {
  Case c{"sliver light", "aspect " + text(1 / width), "Lambert's formula", area_light_sight(1, 1), [width] {
           TestScene s;
           s.quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, s.diffuse(static_cast<float>(kRho)));
           const auto w = static_cast<float>(width);
           const float l = 1 / w;
           s.quad({-0.5, 1, 0}, {1, 0, 0}, {0, 0, w}, s.diffuse(0), {.radiance = {l, l, l}});
           s.camera({0.8, 0.9, 0}, {0, 0, 0}, 60).film(16, 16);
           // So thin a strip is a line: E = L w times the integral of cos cos / d^2 along it.
           const auto irradiance = [&](const Vec3d& p) {
             double sum = 0;
             constexpr int kSteps = 64;
             for (int i = 0; i < kSteps; ++i) {
               const double dx = p.x - (-0.5 + (i + 0.5) / kSteps), dz = p.z - 0.5 * double{w};
               sum += 1 / std::pow(1 + dx * dx + dz * dz, 2);
             }
             return double{l} * w * sum / kSteps;
           };
           const double mean = mean_over_plane(
               s.scene, 0, [&](const Vec3d& p) { return kRho / M_PI * irradiance(p); }, 4);
           return Setup{s.scene, 1, grey(mean), 2e-4};
         }};
  c.notes.push_back({Note::kSkip, kNextEvent | kLightTracing, "a sampled direction never meets the slit"});
  return c;
}

}  // namespace

std::vector<Case> near_light_cases() {
  std::vector<Case> cases;
  for (const double x : {1e-1, 1e-3, 1e-6}) cases.push_back(corner(x));
  for (const double x : {0.5, 1e-2}) cases.push_back(tangent_sphere(x));
  for (const double gap : {1e-3, 1e-6}) cases.push_back(panel_before_wall(gap));
  for (const double width : {1e-4, 1e-8}) cases.push_back(slit(width));
  return cases;
}

}  // namespace lightmill::test
