// Surfaces that coincide or nearly do, and cameras that touch one, in scenes whose answer does not change.
#include <cmath>

#include "tests/extreme/case.h"

namespace lightmill::test {
namespace {

/// Concentric spheres (oracle 6): the outer one is made of `shells`, radii over the radius of the lit one.
Case shells(std::string parameter, std::vector<double> radii, bool every_set) {
  Case c{"coincident surfaces", std::move(parameter), "6 concentric spheres: hidden copies change nothing",
         area_light_sight(1, 8), [radii] {
           constexpr double kR1 = 0.5, kRho1 = 0.75, kRho2 = 0.5;
           TestScene s;
           const int inner = s.diffuse(kRho1), outer = s.diffuse(kRho2);
           s.sphere({0, 0, 0}, kR1, inner, {.radiance = {1, 1, 1}});
           for (const double r : radii) s.sphere({0, 0, 0}, r, outer, {.inward = true});
           // Powers of the 2x2 radiosity matrix, eight events.
           const double f21 = kR1 * kR1;
           double b1 = 1, b2 = 0, seen = 0;
           for (int event = 0; event < 8; ++event) {
             const double next2 = kRho2 * (f21 * b1 + (1 - f21) * b2), next1 = kRho1 * b2;
             b1 = next1;
             b2 = next2;
             seen += b2;
           }
           s.camera({0, 0.75, 0}, {0, 2, 0}, 90).film(16, 16);
           return Setup{s.scene, 8, grey(seen)};
         }};
  c.every_set = every_set;
  return c;
}

/// A closed emissive box (oracle 1), seen from `eye` on or next to a wall.
/// one.
Case camera_in_box(std::string parameter, const Vec3d& eye, const Vec3d& target) {
  return {"camera that touches a surface", std::move(parameter), "1: Le (1 - rho^4) / (1 - rho)",
          area_light_sight(0, 3), [eye, target] {
            TestScene s;
            s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(0.5f), {.radiance = {1, 1, 1}, .inward = true});
            s.camera(eye, target, 80).film(16, 16);
            return Setup{s.scene, 3, grey(1.875)};
          }};
}

/// A camera at `height` over a floor in a constant environment, looking along it.
Case grazing_camera(double height) {
  return {"camera that grazes a floor", "height " + text(height), "2: rho L0",
          without_lens(far_light_sight(1, 1)), [height] {
            TestScene s;
            s.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, s.diffuse(0.6f)).environment({1, 1, 1});
            s.camera({0, height, -0.5}, {0, 0, 0}, height / 0.5 * 180 / M_PI * 0.8).film(16, 16);
            return Setup{s.scene, 3, grey(double{0.6f}), 1e-4};
          }};
}

}  // namespace

std::vector<Case> contact_cases() {
  std::vector<Case> cases{shells("one shell", {1}, true), shells("the shell twice", {1, 1}, false),
                          shells("a copy 1e-6 behind", {1, 1 + 1e-6}, false),
                          shells("a copy 1e-3 behind", {1, 1 + 1e-3}, false)};
  cases.push_back(camera_in_box("on the wall behind", {0.25, 0.125, -1}, {0, 0, 1}));
  cases.push_back(camera_in_box("1e-6 off the wall behind", {0.25, 0.125, -1 + 1e-6}, {0, 0, 1}));
  cases.push_back(camera_in_box("1e-6 before a wall", {0.25, 0.125, 1 - 1e-6}, {0.25, 0.125, 2}));
  cases.push_back(camera_in_box("1e-6 from a corner", {1 - 1e-6, 1 - 1e-6, 1 - 1e-6}, {0, 0, 0}));
  for (Case& c : cases) {
    if (c.parameter == "1e-6 before a wall" || c.parameter == "1e-6 from a corner")
      c.sight = without_lens(c.sight);
  }
  for (const double height : {1e-2, 1e-4, 1e-6}) cases.push_back(grazing_camera(height));
  return cases;
}

}  // namespace lightmill::test
