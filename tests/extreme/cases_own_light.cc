// Light that a curved emitter sends to its own points, lamps that are hidden, and cones of light that are
// narrow: where next-event estimation and the scale of sums are at their limits.
#include <cmath>
#include <numbers>

#include "tests/extreme/case.h"
#include "tests/extreme/random/draw.h"
#include "tests/extreme/solids.h"

namespace lightmill::test {
namespace {

constexpr float kRho = 0.5f;
constexpr int kDepth = 30;

/// A closed shape that emits inwards: its points light each other.
Case closed_solid(Solid solid, double radius, double off) {
  Case c{"22 closed emitter",
         std::string(solid_name(solid)) + ", radius " + text(radius) + ", off " + text(off),
         "Le (1 - rho^31) / (1 - rho)", area_light_sight(0, kDepth), [=] {
           TestScene s;
           add_solid(&s, solid, 16, s.diffuse(kRho), {.radiance = {1, 0.5f, 2}, .inward = true});
           s.camera({0.05, -0.03, 0.02}, {1, 0.4, 0.6}, 90).film(16, 16);
           place(radius, 33, {1, 2, 3}, Vec3d{0.6, -0.8, 0.3} * (off * radius), &s.scene);
           return Setup{s.scene, kDepth, {2, 1, 4}};
         }};
  c.every_set = solid == Solid::kSphere && radius == 1;
  return c;
}

/// A part of a sphere: every point of it gets the same from every other.
Case bowl(double top, double radius) {
  return {"22 emitting bowl", "up to z " + text(top) + ", radius " + text(radius),
          "Le / (1 - rho A / (4 pi R^2))", area_light_sight(0, kDepth), [=] {
            TestScene s;
            add_bowl(&s, top, 256, s.diffuse(kRho), {.radiance = {1, 0.5f, 2}, .inward = true});
            s.camera({0, 0, -0.5}, {0, 0, -1}, 40).film(16, 16);
            place(radius, 33, {1, 2, 3}, Vec3d{0.6, -0.8, 0.3} * (1e3 * radius), &s.scene);
            const double x = 1 / (1 - kRho * (top + 1) / 2);
            return Setup{s.scene, kDepth, {x, 0.5 * x, 2 * x}, 1e-3};
          }};
}

/// A floor under a ball of light, and a lamp shut into a black shell below the floor.
Case hidden_lamp(double intensity) {
  return {"23 hidden lamp", "intensity " + text(intensity), "rho L (R/h)^2",
          without_lens(area_light_sight(1, 1)), [=] {
            TestScene s;
            s.quad({-50, 0, -50}, {0, 0, 100}, {100, 0, 0}, s.diffuse(kRho));
            s.sphere({0, 2, 0}, 0.5, s.diffuse(0), {.radiance = {1, 2, 0.5f}});
            s.sphere({5, -10, 5}, 1, s.diffuse(0));
            const auto i = static_cast<float>(intensity);
            s.point_light({5, -10, 5}, {i, i, i});
            s.camera({0, 12, -30}, {0, 0, 0}, 0.002).film(8, 8);
            return Setup{s.scene, 1, {0.03125, 0.0625, 0.015625}};
          }};
}

/// What a slab emits, beside a lamp of which nothing is seen.
Case glowing_slab(double intensity) {
  return {"23 glowing slab", "lamp of " + text(intensity), "Le (1 - exp(-sigma))", only_hits(0), [=] {
            TestScene s;
            s.box({-3, -3, 0.5}, {3, 3, 1.5}, s.diffuse(0));
            s.scene.media.push_back({"", {0.7f, 0.7f, 0.7f}, {}, {2, 1, 4}, 0, {}});
            for (ShapeDescription& shape : s.scene.shapes) {
              shape.media = {0, -1};
              shape.boundary = true;
            }
            const auto i = static_cast<float>(intensity);
            s.point_light({0, 0, -5}, {i, i, i});
            s.camera({0, 0, 0}, {0, 0, 1}, 0.1).film(16, 16);
            const double x = -2 * std::expm1(-double{0.7f});
            return Setup{s.scene, 1, {x, 0.5 * x, 2 * x}};
          }};
}

/// A spot light that shines straight down; what is seen lies in the even part of its cone.
Case narrow_spot(double degrees) {
  return {
      "24 narrow spot light", text(degrees) + " degrees", "rho I / (pi h^2)",
      without_lens(delta_light_sight(1, 1)), [=] {
        TestScene s;
        // A hit is known to 1e-7 of its triangle and of its distance, which must be less than the cone.
        s.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, s.diffuse(kRho));
        s.scene.lights.push_back({SpotLight{{3, 6, 1.5f}, {0, 2, 0}, {0, -1, 0}, degrees / 2, degrees}, {}});
        // A sixth of the even part across.
        s.camera({0, 1.2, -1.6}, {0, 0, 0}, degrees / 10).film(8, 8);
        const double x = 3 * double{kRho} / (std::numbers::pi * 4);
        // Directions of light paths are known to 6e-8.
        return Setup{s.scene, 1, {x, 2 * x, 0.5 * x}, degrees < 1e-3 ? 2e-3 : 1e-5};
      }};
}

}  // namespace

std::vector<Case> own_light_cases() {
  std::vector<Case> cases;
  for (int i = 0; i < kSolids; ++i) {
    const auto solid = static_cast<Solid>(i);
    cases.push_back(closed_solid(solid, 1, 0));
    cases.push_back(closed_solid(solid, 1e-6, 1e3));
    cases.push_back(closed_solid(solid, 1e6, 1e3));
  }
  for (const double top : {-0.9, 0.0, 0.8}) cases.push_back(bowl(top, top == 0 ? 1 : top < 0 ? 1e-6 : 1e6));
  for (const double intensity : {1e-30, 1e-3, 1e18, 1e30}) cases.push_back(hidden_lamp(intensity));
  for (const double intensity : {1e-20, 1e-15, 1e-12, 1.0, 1e20}) cases.push_back(glowing_slab(intensity));
  for (const double degrees : {1e-4, 1e-3, 0.01, 1.0}) cases.push_back(narrow_spot(degrees));
  return cases;
}

}  // namespace lightmill::test
