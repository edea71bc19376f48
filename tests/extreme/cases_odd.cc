// Views, lights and surfaces at ends that no oracle names by itself: lenses focused on their own glass, views
// of a thousandth of a degree, lamps smaller than floats' steps, lamps on top of each other.
#include <cmath>

#include "tests/extreme/case.h"
#include "tests/statistical/oracles/form_factor.h"

namespace lightmill::test {
namespace {

constexpr double kRho = 0.5;

/// A closed emissive box (oracle 1) by a camera that `view` sets up: the same radiance in every direction.
Case view_in_box(std::string parameter, Sight sight, std::function<void(TestScene&)> view) {
  return {"odd views in a closed box", std::move(parameter), "1: Le (1 - rho^4) / (1 - rho)", sight, [view] {
            TestScene s;
            s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(static_cast<float>(kRho)),
                  {.radiance = {1, 1, 1}, .inward = true});
            s.camera({0.25, -0.125, 0.375}, {1, 0.5, 0.625}, 90).film(16, 16);
            view(s);
            return Setup{s.scene, 3, grey(1.875), 1e-4};
          }};
}

std::vector<Case> view_cases() {
  const Sight all = area_light_sight(0, 3), small = without_lens(all);
  const auto lens = [](double radius, double focus) {
    return [radius, focus](TestScene& s) {
      s.scene.camera.lens_radius = radius;
      s.scene.camera.focal_distance = focus;
    };
  };
  std::vector<Case> cases;
  for (const double fov : {1e-3, 179.9})
    cases.push_back(
        view_in_box("fov " + text(fov), small, [fov](TestScene& s) { s.scene.camera.fov_degrees = fov; }));
  // Focused on its own glass, all of a lens looks along it: none of its rays has a weight worth a light path.
  for (const double focus : {1e-6, 1e9})
    cases.push_back(view_in_box("lens 0.1, focus " + text(focus), focus < 1 ? small : all, lens(0.1, focus)));
  cases.push_back(view_in_box("spherical", all, [](TestScene& s) {
    s.scene.camera.kind = CameraKind::kSpherical;
    s.scene.camera.mapping = SphericalMapping::kEquirectangular;
  }));
  cases.push_back(view_in_box("one pixel", all, [](TestScene& s) { s.film(1, 1); }));
  cases.back().notes.push_back({Note::kNoisy, 0, "a pixel has no more values than there are batches"});
  cases.push_back(view_in_box("film of 1 x 300", all, [](TestScene& s) { s.film(1, 300); }));
  cases.back().notes.push_back({Note::kNoisy, kEmissionHits, "few light paths meet a view one pixel wide"});
  cases.push_back(view_in_box("orthographic, 1e-6 wide", small, [](TestScene& s) {
    s.scene.camera.kind = CameraKind::kOrthographic;
    s.scene.camera.screen_window = std::array<double, 4>{-5e-7, 5e-7, -5e-7, 5e-7};
  }));
  return cases;
}

/// A floor seen straight from above over a square of half-width `half`.
TestScene floor_from_above(double half) {
  TestScene s;
  const double side = std::max(1.0, 2 * half);
  s.quad({-side, 0, -side}, {0, 0, 2 * side}, {2 * side, 0, 0}, s.diffuse(static_cast<float>(kRho)));
  s.camera({0, 0.5, 0}, {0, 0, 0}, 0).film(16, 16);
  s.scene.camera.kind = CameraKind::kOrthographic;
  s.scene.camera.screen_window = std::array<double, 4>{-half, half, -half, half};
  return s;
}

/// All of a spot's light is in view, so that the mean is its flux: its smoothstep over the cosine is 1/2.
Case narrow_spot(double degrees) {
  return {
      "spot light", "half-angle " + text(degrees) + " deg",
      "flux pi I ((1 - cos start) + (1 - cos end)) in view", delta_light_sight(1, 1), [degrees] {
        const auto one_minus_cos = [](double angle) { return 2 * std::pow(std::sin(angle * M_PI / 360), 2); };
        const double start = 0.8 * degrees, half = 1.25 * std::tan(degrees * M_PI / 180);
        TestScene s = floor_from_above(half);
        const auto intensity =
            static_cast<float>(half * half * 4 / (one_minus_cos(start) + one_minus_cos(degrees)));
        s.scene.lights.push_back(
            {SpotLight{{intensity, intensity, intensity}, {0, 1, 0}, {0, -1, 0}, start, degrees}, {}});
        const double flux = M_PI * intensity * (one_minus_cos(start) + one_minus_cos(degrees));
        return Setup{s.scene, 1, grey(kRho / M_PI * flux / (4 * half * half)), degrees < 0.1 ? 2e-3 : 1e-4};
      }};
}

/// A lamp smaller than the steps between floats where it hangs.
Case tiny_triangle(double area) {
  Case c{"tiny emitting triangle", "area " + text(area), "E = L A cos cos / d^2", area_light_sight(1, 1),
         [area] {
           TestScene s;
           s.quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, s.diffuse(static_cast<float>(kRho)));
           s.camera({0.5, 2, -1}, {0, 0, 0}, 50).film(16, 16);
           const auto l = static_cast<float>(1 / area);
           const double side = double{static_cast<float>(std::sqrt(2 * area))};
           s.triangle({0, 1, 0}, {side, 1, 0}, {0, 1, side}, s.diffuse(0), {.radiance = {l, l, l}});
           const double flux = 0.5 * side * side * l;
           const double mean = mean_over_plane(
               s.scene, 0,
               [&](const Vec3d& p) { return kRho / M_PI * flux / std::pow(p.x * p.x + p.z * p.z + 1, 2); },
               8);
           return Setup{s.scene, 1, grey(mean), 1e-4};
         }};
  c.notes.push_back(
      {Note::kSkip, kNextEvent | kLightTracing, "a sampled direction never meets so small a light"});
  return c;
}

/// The same panel several times, as scenes have it that list a mesh twice.
Case coincident_lamps(int copies) {
  return {"coincident lamps", std::to_string(copies) + " times the same panel", "10: of one panel",
          area_light_sight(1, 1), [copies] {
            TestScene s;
            s.quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, s.diffuse(static_cast<float>(kRho)));
            const Vec3d a{-0.5, 1, -0.5}, u{1, 0, 0}, v{0, 0, 1};
            for (int i = 0; i < copies; ++i) s.quad(a, u, v, s.diffuse(0), {.radiance = {3, 3, 3}});
            s.camera({0.5, 0.9, -1.5}, {0, 0, 0.3}, 40).film(16, 16);
            const std::vector<Vec3d> corners{a, a + u, a + u + v, a + v};
            const double mean = mean_over_plane(
                s.scene, 0,
                [&](const Vec3d& p) {
                  return kRho / M_PI * 3 * polygon_irradiance(corners, p, {0, 1, 0});
                },
                8);
            return Setup{s.scene, 1, grey(mean), 1e-4};
          }};
}

/// Many lights in one point are one light.
Case crowded_point(int count) {
  return {"lights in one point", text(count), "7: rho I h / (pi (h^2 + x^2)^(3/2))", delta_light_sight(1, 1),
          [count] {
            TestScene s;
            s.quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, s.diffuse(static_cast<float>(kRho)));
            s.camera({0.5, 2, -1}, {0, 0, 0}, 50).film(16, 16);
            const auto each = static_cast<float>(4.0 / count);
            for (int i = 0; i < count; ++i) s.point_light({0.3, 1.5, 0.2}, {each, each, each});
            const double mean = mean_over_plane(
                s.scene, 0,
                [](const Vec3d& p) {
                  return kRho / M_PI * 4 * 1.5 /
                         std::pow(std::pow(p.x - 0.3, 2) + std::pow(p.z - 0.2, 2) + 2.25, 1.5);
                },
                8);
            return Setup{s.scene, 1, grey(mean), 1e-4};
          }};
}

/// Point lights that only next event and light paths can find, one `ratio` times as bright, each in a
/// channel.
Case unequal_points(double ratio) {
  Case c{"point lights of unequal power", "1 to " + text(ratio), "7 for either", delta_light_sight(1, 1),
         [ratio] {
           TestScene s;
           s.quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, s.diffuse(static_cast<float>(kRho)));
           s.camera({0.5, 2, -1}, {0, 0, 0}, 50).film(16, 16);
           s.point_light({0.3, 1.5, 0.2}, {0, 1, 0});
           const auto bright = static_cast<float>(ratio);
           s.point_light({-0.4, 1.2, 0.1}, {bright, 0, 1});
           const auto mean = [&](const Vec3d& at) {
             return mean_over_plane(
                 s.scene, 0,
                 [&](const Vec3d& p) {
                   return kRho / M_PI * at.y /
                          std::pow(std::pow(p.x - at.x, 2) + std::pow(p.z - at.z, 2) + at.y * at.y, 1.5);
                 },
                 8);
           };
           const double far = mean({-0.4, 1.2, 0.1});
           return Setup{s.scene, 1, {bright * far, mean({0.3, 1.5, 0.2}), far}, 1e-4};
         }};
  c.notes.push_back({Note::kNoisy, 0, "one sample in 32 is the dim lamp's"});
  return c;
}

/// Metals whose index float cannot square twice reflect everything.
Case extreme_metal(float eta, float k) {
  return {"metal of extreme index", "eta " + text(eta) + ", k " + text(k), "13: L r, r = 1", specular_sight(),
          [eta, k] {
            TestScene s;
            const int mirror = s.conductor(0.5f, 0);
            auto& metal = std::get<ConductorMaterial>(s.scene.materials[static_cast<size_t>(mirror)].kind);
            metal.reflectance.reset();
            metal.eta.value = {eta, eta, eta};
            metal.k.value = {k, k, k};
            s.quad({-1, -1, 2}, {0, 2, 0}, {2, 0, 0}, mirror);
            s.quad({-30, -30, -2}, {60, 0, 0}, {0, 60, 0}, s.diffuse(0), {.radiance = {3, 3, 3}});
            s.camera({0, 0, 0}, {0, 0, 1}, 4).film(16, 16);
            const double r = (std::pow(double{eta} - 1, 2) + double{k} * k) /
                             (std::pow(double{eta} + 1, 2) + double{k} * k);
            return Setup{s.scene, 5, grey(3 * r), 1e-4};
          }};
}

}  // namespace

std::vector<Case> odd_cases() {
  std::vector<Case> cases = view_cases();
  for (const double degrees : {60.0, 1.0, 1e-2, 1e-3}) cases.push_back(narrow_spot(degrees));
  for (const double area : {1e-10, 1e-14, 1e-20, 1e-30}) cases.push_back(tiny_triangle(area));
  for (const int copies : {2, 5}) cases.push_back(coincident_lamps(copies));
  for (const int count : {16, 10000}) cases.push_back(crowded_point(count));
  cases.push_back(crowded_point(1000000));
  cases.back().full_only = true;
  for (const double ratio : {1e3, 1e9}) cases.push_back(unequal_points(ratio));
  for (const auto& [eta, k] : {std::pair{1e-6f, 0.0f}, {1.0f, 1e10f}, {1e-6f, 1e6f}, {1e30f, 1e30f}})
    cases.push_back(extreme_metal(eta, k));
  return cases;
}

}  // namespace lightmill::test
