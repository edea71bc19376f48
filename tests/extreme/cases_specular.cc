// Oracles 3, 4, 13, 14 and 15: glass, mirrors, and microfacets from a mirror to the roughest.
#include <cmath>
#include <complex>

#include "tests/extreme/case.h"

namespace lightmill::test {
namespace {

/// Glass shapes in a constant environment, which are invisible: radiance over n^2 is the same everywhere.
Case invisible(std::string name, std::string parameter, std::function<void(TestScene&)> add) {
  return {std::move(name), std::move(parameter), "L0", specular_sight(), [add] {
            TestScene s;
            add(s);
            s.environment({2, 1, 0.5}).camera({0, 0.5, -4}, {0, 0, 0}, 40).film(16, 16);
            return Setup{s.scene, kUnlimitedDepth, {2, 1, 0.5}, 1e-4};
          }};
}

Case inside_glass(float n) {
  return {"4 camera inside glass", "n " + text(n), "n^2 L0", specular_sight(), [n] {
            TestScene s;
            s.sphere({0, 0, 0}, 1, s.dielectric(n, 0)).environment({1, 1, 1});
            s.camera({0, 0, 0}, {0.3, 0.2, 1}, 50).film(16, 16);
            return Setup{s.scene, kUnlimitedDepth, grey(double{n} * n), 1e-4};
          }};
}

/// Normal incidence to within the tiny view.
Case parallel_mirrors(float r, int depth) {
  return {"13 parallel mirrors", "r " + text(r) + ", depth " + std::to_string(depth), "sum L r^k",
          specular_sight(), [r, depth] {
            TestScene s;
            const int mirror = s.conductor(r, 0);
            s.quad({-1e3, -1e3, 1}, {0, 2e3, 0}, {2e3, 0, 0}, mirror, {.radiance = {1, 1, 1}});
            s.quad({-1e3, -1e3, -1}, {2e3, 0, 0}, {0, 2e3, 0}, mirror, {.radiance = {1, 1, 1}});
            const int side = depth > 100 ? 4 : 16;
            s.camera({0, 0, 0}, {0, 0, 1}, 2).film(side, side);
            const double exact = -std::expm1((depth + 1) * std::log(double{r})) / (1 - double{r});
            return Setup{s.scene, depth, grey(exact), 1e-3};
          }};
}

Case plane_mirror(float alpha) {
  return {"13 plane mirror", "r 0.7, alpha " + text(alpha), "L r", specular_sight(), [alpha] {
            TestScene s;
            s.quad({-1, -1, 2}, {0, 2, 0}, {2, 0, 0}, s.conductor(0.7f, alpha));
            s.quad({-30, -30, -2}, {60, 0, 0}, {0, 60, 0}, s.diffuse(0), {.radiance = {3, 3, 3}});
            s.camera({0, 0, 0}, {0, 0, 1}, 4).film(16, 16);
            return Setup{s.scene, 5, grey(3 * double{0.7f}), 1e-4};
          }};
}

Case slab(float n) {
  return {"14 dielectric slab", "n " + text(n), "T = (1 - F) / (1 + F), R = 1 - T", specular_sight(), [n] {
            const double f = std::pow((double{n} - 1) / (double{n} + 1), 2), t = (1 - f) / (1 + f);
            TestScene s;
            s.box({-20, -20, 1}, {20, 20, 1.2}, s.dielectric(n, 0));
            const int black = s.diffuse(0);
            s.quad({-60, -60, 3}, {0, 120, 0}, {120, 0, 0}, black, {.radiance = {5, 1, 1}});
            s.quad({-60, -60, -3}, {120, 0, 0}, {0, 120, 0}, black, {.radiance = {2, 1, 3}});
            s.camera({0, 0, 0}, {0, 0, 1}, 2).film(16, 16);
            return Setup{s.scene, kUnlimitedDepth, {5 * t + 2 * (1 - t), 1, t + 3 * (1 - t)}, 1e-3};
          }};
}

double conductor_fresnel(double cosine, double r) {
  const std::complex<double> eta(1, 2 * std::sqrt(r / (1 - r)));
  const double sine2 = 1 - cosine * cosine;
  const std::complex<double> t = std::sqrt(1.0 - sine2 / (eta * eta));
  const auto parallel = (eta * cosine - t) / (eta * cosine + t),
             across = (cosine - eta * t) / (cosine + eta * t);
  return 0.5 * (std::norm(parallel) + std::norm(across));
}

/// Directional albedo of GGX with Smith's height-correlated masking, over slopes: normals m drawn from
/// D(m) cos(m), tan^2 = alpha^2 u / (1 - u); the integrand is F G (o . m) / (cos o cos m).
double ggx_albedo(double alpha, double cosine, double r) {
  constexpr int kU = 1500, kPhi = 720;
  const double ox = std::sqrt(1 - cosine * cosine), oz = cosine;
  const auto lambda = [&](double x2, double z2) {
    return 0.5 * (std::sqrt(1 + alpha * alpha * x2 / z2) - 1);
  };
  double sum = 0;
  for (int i = 0; i < kU; ++i) {
    // u = 1 - (1 - x)^3: finer where the normals lie flat.
    const double x = (i + 0.5) / kU, u = 1 - std::pow(1 - x, 3), du = 3 * std::pow(1 - x, 2) / kU;
    const double tan2 = alpha * alpha * u / (1 - u), mz = 1 / std::sqrt(1 + tan2), ms = std::sqrt(tan2) * mz;
    for (int j = 0; j < kPhi; ++j) {
      const double phi = M_PI * (j + 0.5) / kPhi, mx = ms * std::cos(phi), my = ms * std::sin(phi);
      const double om = ox * mx + oz * mz;
      if (om <= 0) continue;
      const double ix = 2 * om * mx - ox, iy = 2 * om * my, iz = 2 * om * mz - oz;
      if (iz <= 0) continue;
      const double g = 1 / (1 + lambda(ox * ox, oz * oz) + lambda(ix * ix + iy * iy, iz * iz));
      sum += conductor_fresnel(om, r) * g * om / (oz * mz) * du / kPhi;
    }
  }
  return sum;
}

/// A rough metal plane in a constant environment, by an orthographic camera, so that one angle is seen.
Case ggx_furnace(float alpha, double degrees, bool every_set = false) {
  Case c{"15 GGX in a furnace", "alpha " + text(alpha) + ", " + text(degrees) + " deg",
         "quadrature of the albedo, F ~ 1", far_light_sight(1, 1), [alpha, degrees] {
           constexpr float kR = 0.9999f;
           const double a = degrees * M_PI / 180;
           TestScene s;
           s.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, s.conductor(kR, alpha)).environment({1, 1, 1});
           s.camera({0, std::cos(a), -std::sin(a)}, {0, 0, 0}, 0).film(16, 16);
           s.scene.camera.kind = CameraKind::kOrthographic;
           const double half = 0.9 * std::cos(a);  // the view stays on the plane
           s.scene.camera.screen_window = std::array<double, 4>{-0.9, 0.9, -half, half};
           const bool smooth = alpha <= 1e-3f;
           const double exact =
               smooth ? conductor_fresnel(std::cos(a), kR) : ggx_albedo(alpha, std::cos(a), kR);
           return Setup{s.scene, 3, grey(exact), smooth ? 1e-5 : 3e-4};
         }};
  if (alpha <= 1e-3f) c.sight = {kEmissionHits, kEmissionHits, kEmissionHits, 1, 1};
  c.every_set = every_set;
  if (alpha < 0.2f)
    c.notes.push_back({Note::kSkip, kEmissionHits, "light directions drawn without the lobe miss it"});
  return c;
}

}  // namespace

std::vector<Case> specular_cases() {
  std::vector<Case> cases;
  for (const float n : {1.0000001f, 1.3f, 1.5f, 4.0f}) {
    cases.push_back(invisible("3 glass sphere", "n " + text(n), [n](TestScene& s) {
      s.sphere({0, 0, 0}, 1, s.dielectric(n, 0));
    }));
  }
  cases.push_back(invisible("3 glass sphere", "n 1, alpha 0.5", [](TestScene& s) {
    s.sphere({0, 0, 0}, 1, s.dielectric(1, 0.5f));
  }));
  cases.push_back(invisible("3 hollow glass sphere", "r 0.85", [](TestScene& s) {
    const int glass = s.dielectric(1.5f, 0);
    s.sphere({0, 0, 0}, 1, glass).sphere({0, 0, 0}, 0.85, glass, {.inward = true});
  }));
  for (const double wall : {1e-4, 1e-5, 1e-6}) {
    cases.push_back(invisible("3 hollow glass sphere", "wall " + text(wall), [wall](TestScene& s) {
      const int glass = s.dielectric(1.5f, 0);
      s.sphere({0, 0, 0}, 1, glass).sphere({0, 0, 0}, 1 - wall, glass, {.inward = true});
    }));
    if (wall < 1e-5) {
      // Seen from four radii away the wall is two steps of float thick. Rays leave a surface by the bound of
      // their error, beyond the other face, and the refractions are counted in the wrong order: 28 % dark.
      cases.back().notes.push_back(
          {Note::kKnown, 0, "thinner than the error of float positions at this distance"});
    }
  }
  cases.push_back(invisible("3 nested glass spheres", "n 1.3 2.4 1.1", [](TestScene& s) {
    s.sphere({0, 0, 0}, 1, s.dielectric(1.3f, 0)).sphere({0.1, 0, 0}, 0.7, s.dielectric(2.4f, 0));
    s.sphere({0.1, 0.1, 0}, 0.4, s.dielectric(1.1f, 0));
  }));
  cases.push_back(invisible("3 overlapping glass spheres", "n 1.5 1.3", [](TestScene& s) {
    s.sphere({-0.4, 0, 0}, 0.8, s.dielectric(1.5f, 0)).sphere({0.4, 0, 0}, 0.8, s.dielectric(1.3f, 0));
  }));
  cases.push_back(invisible("3 thin glass sphere", "n 1.5", [](TestScene& s) {
    s.sphere({0, 0, 0}, 1, s.thin_dielectric(1.5f));
  }));
  for (const float n : {1.0000001f, 1.5f, 4.0f}) cases.push_back(inside_glass(n));
  for (const float alpha : {0.0f, 1e-6f}) cases.push_back(plane_mirror(alpha));
  cases.push_back(parallel_mirrors(0.8f, 9));
  cases.push_back(parallel_mirrors(0.999f, 1000));
  for (const float n : {1.0000001f, 1.5f, 4.0f}) cases.push_back(slab(n));
  for (const double degrees : {0.0, 60.0, 85.0}) {
    for (const float alpha : {1e-6f, 0.01f, 0.3f, 1.0f})
      cases.push_back(ggx_furnace(alpha, degrees, alpha == 0.3f && degrees == 60));
  }
  return cases;
}

}  // namespace lightmill::test
