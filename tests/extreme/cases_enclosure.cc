// Oracles 1, 2, 5, 6 and 16: everything encloses everything, or one wall is all there is to see.
#include <cmath>

#include "tests/extreme/case.h"

namespace lightmill::test {
namespace {

/// Sum of a geometric series of `terms` terms.
double series(double ratio, int terms) {
  return ratio == 1 ? terms : -std::expm1(terms * std::log(ratio)) / (1 - ratio);
}

std::string depth_text(int depth) { return depth == kUnlimitedDepth ? "unlimited" : std::to_string(depth); }

Case closed_box(float rho, int depth, bool every_set = false) {
  Case c{"1 closed emissive box", "rho " + text(rho) + ", depth " + depth_text(depth),
         "Le (1 - rho^(depth + 1)) / (1 - rho)", area_light_sight(0, depth), [rho, depth] {
           TestScene s;
           s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(rho), {.radiance = {1, 0.5f, 2}, .inward = true});
           s.camera({0.2, -0.1, 0.3}, {1, 0.4, 0.6}, 90).film(depth > 100 ? 4 : 16, depth > 100 ? 4 : 16);
           const double x = depth == kUnlimitedDepth ? 1 / (1 - double{rho}) : series(rho, depth + 1);
           return Setup{s.scene, depth, {x, 0.5 * x, 2 * x}, depth > 100 ? 1e-4 : 1e-5};
         }};
  c.every_set = every_set;
  return c;
}

Case convex_object(bool sphere, float rho) {
  return {"2 convex object in an environment", std::string(sphere ? "sphere" : "cube") + ", rho " + text(rho),
          "rho L0", far_light_sight(1, 1), [sphere, rho] {
            TestScene s;
            const int m = s.diffuse(Rgb{rho, 0.5f * rho, 0.1f * rho});
            if (sphere) {
              s.sphere({0, 0, 0}, 1, m);
            } else {
              s.box({-1, -1, -1}, {1, 1, 1}, m);
            }
            s.environment({2, 2, 2}).camera({0.4, 0.9, -3}, {0, 0, 0}, 22).film(16, 16);
            return Setup{s.scene, 3, {2.0 * rho, 1.0 * rho, double{0.1f * rho} * 2}};
          }};
}

Case sphere_around_point(float rho, int depth, bool every_set = false) {
  Case c{"5 sphere around a point light", "rho " + text(rho) + ", depth " + depth_text(depth),
         "I rho / (pi R^2) (1 - rho^depth) / (1 - rho)", delta_light_sight(1, depth), [rho, depth] {
           constexpr float kRadius = 2, kIntensity = 3;
           TestScene s;
           s.sphere({0, 0, 0}, kRadius, s.diffuse(rho));
           s.point_light({0, 0, 0}, {kIntensity, kIntensity, kIntensity});
           s.camera({0.5, 0.3, -0.7}, {1, 0, 1}, 90).film(depth > 100 ? 4 : 16, depth > 100 ? 4 : 16);
           const double direct = rho / M_PI * kIntensity / (kRadius * kRadius);
           return Setup{s.scene, depth, grey(direct * series(rho, depth)), depth > 100 ? 1e-4 : 1e-5};
         }};
  c.every_set = every_set;
  return c;
}

Case concentric(double ratio, bool every_set = false) {
  Case c{"6 concentric diffuse spheres", "r1/r2 " + text(ratio), "2x2 radiosity: F12 = 1, F21 = (r1/r2)^2",
         area_light_sight(1, kUnlimitedDepth), [ratio] {
           constexpr float kRho1 = 0.7f, kRho2 = 0.4f;
           TestScene s;
           const auto emitted = static_cast<float>(1 / (ratio * ratio));
           s.sphere({0, 0, 0}, ratio, s.diffuse(kRho1), {.radiance = {emitted, emitted, emitted}});
           s.sphere({0, 0, 0}, 1, s.diffuse(kRho2), {.inward = true});
           const double r = static_cast<float>(ratio), f21 = r * r;
           // B2 = rho2 (F21 B1 + (1 - F21) B2), B1 = E1 + rho1 B2.
           const double b2 = kRho2 * f21 * emitted / (1 - kRho2 * f21 * kRho1 - kRho2 * (1 - f21));
           const double eye = 0.5 * (1 + ratio);
           s.camera({0, eye, 0}, {0, 2, 0}, 90).film(16, 16);
           return Setup{s.scene, kUnlimitedDepth, grey(b2)};
         }};
  c.every_set = every_set;
  return c;
}

Case emissive_wall() {
  return {"16 emissive wall by the lens", "depth 0", "L in every pixel", area_light_sight(0, 0), [] {
            TestScene s;
            s.quad({-1, -1, 2}, {0, 2, 0}, {2, 0, 0}, s.diffuse(0), {.radiance = {1, 2, 3}, .inward = false});
            s.camera({0, 0, 0}, {0, 0, 1}, 45).film(16, 16);
            return Setup{s.scene, 0, {1, 2, 3}};
          }};
}

}  // namespace

std::vector<Case> enclosure_cases() {
  std::vector<Case> cases{
      closed_box(0.5f, 0),       closed_box(0.5f, 5, true),          closed_box(0.8f, 12),
      closed_box(0.999f, 1000),  closed_box(0.99f, kUnlimitedDepth), closed_box(0.999f, kUnlimitedDepth),
      closed_box(0.9999f, 2000), closed_box(0.9999f, 4000)};
  for (const bool sphere : {true, false}) {
    for (const float rho : {0.5f, 0.9999f}) cases.push_back(convex_object(sphere, rho));
  }
  cases[5].full_only = true;
  cases[7].every_set = true;
  cases.push_back(sphere_around_point(0.6f, 4, true));
  cases.push_back(sphere_around_point(0.999f, 1000));
  cases.push_back(sphere_around_point(0.9999f, 2000));
  cases.back().full_only = true;
  cases.push_back(concentric(0.5, true));
  cases.push_back(concentric(0.999));
  cases.back().sight = without_lens(cases.back().sight);  // the gap's view is a thousandth of the spheres
  cases.push_back(concentric(1e-3));
  cases.back().notes.push_back(
      {Note::kSkip, kNextEvent | kLightTracing, "a sampled direction all but never meets the inner sphere"});
  cases.push_back(emissive_wall());
  for (Case& c : cases) {
    if (c.sight.last >= 1000 && c.name[0] != '6') {
      c.pt_only = true;
      c.notes.push_back({Note::kSkip, kEmissionHits | kNextEvent, "a thousand events per light path"});
    }
  }
  return cases;
}

}  // namespace lightmill::test
