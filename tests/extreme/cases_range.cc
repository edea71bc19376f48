// Oracle 1 again where numbers are at the ends of their range: radiance, distance from the
// origin, thin triangles.
#include <cmath>

#include "tests/extreme/case.h"

namespace lightmill::test {
namespace {

constexpr float kRho = 0.5f;
constexpr int kDepth = 3;
constexpr double kSeries = 1.875;  // 1 + 1/2 + 1/4 + 1/8

TestScene box_scene(const Vec3d& at = {}, double half = 1, float radiance = 1) {
  TestScene s;
  const Vec3d d{half, half, half};
  s.box(at - d, at + d, s.diffuse(kRho), {.radiance = {radiance, radiance, radiance}, .inward = true});
  s.camera(at + Vec3d{0.25, -0.125, 0.375} * half, at + Vec3d{1, 0.5, 0.625} * half, 90).film(16, 16);
  return s;
}

Case box_case(std::string name, std::string parameter, std::function<Setup()> build) {
  return {std::move(name), std::move(parameter), "1: Le (1 - rho^4) / (1 - rho)", area_light_sight(0, kDepth),
          std::move(build)};
}

void translate(SceneDescription* scene, const Vec3d& by) {
  const auto move = [&](Transform& t) {
    t.m[0][3] += by.x;
    t.m[1][3] += by.y;
    t.m[2][3] += by.z;
  };
  for (ShapeDescription& s : scene->shapes) move(s.object_to_world);
  move(scene->camera.camera_to_world);
}

/// A floor of strips across the camera's plane z = 0, whose widths double from `thinnest` to the walls: all
/// share their long edges' vertices.
TestScene sliver_box(double thinnest) {
  TestScene s;
  const Emits glow{.radiance = {1, 1, 1}};
  const int m = s.diffuse(kRho);
  s.quad({-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, m, glow);   // ceiling, facing down
  s.quad({-1, -1, 1}, {0, 2, 0}, {2, 0, 0}, m, glow);   // z = 1
  s.quad({-1, -1, -1}, {2, 0, 0}, {0, 2, 0}, m, glow);  // z = -1
  s.quad({-1, -1, -1}, {0, 2, 0}, {0, 0, 2}, m, glow);  // x = -1
  s.quad({1, -1, -1}, {0, 0, 2}, {0, 2, 0}, m, glow);   // x = 1
  std::vector<double> edges{0};
  for (double z = thinnest; z < 1; z *= 2) edges.push_back(z);
  edges.push_back(1);
  for (size_t i = 1; i < edges.size(); ++i) {
    const double a = edges[i - 1], b = edges[i];
    for (const double sign : {1.0, -1.0}) {
      const double lo = std::min(sign * a, sign * b), hi = std::max(sign * a, sign * b);
      s.triangle({-1, -1, lo}, {-1, -1, hi}, {1, -1, hi}, m, glow);
      s.triangle({-1, -1, lo}, {1, -1, hi}, {1, -1, lo}, m, glow);
    }
  }
  s.camera({0.3, 0.2, 0}, {0, -1, 0}, 90).film(16, 16);
  return s;
}

}  // namespace

std::vector<Case> range_cases() {
  std::vector<Case> cases;
  for (const float radiance : {1e-36f, 1e-30f, 1e-20f, 1e20f, 1e30f, 1e36f}) {
    cases.push_back(box_case("emitter radiance", text(radiance), [radiance] {
      return Setup{box_scene({}, 1, radiance).scene, kDepth, grey(kSeries * radiance)};
    }));
  }
  for (const double k : {1e3, 1e7, 1e12}) {
    cases.push_back(box_case("far from the origin, by transforms", text(k) + " units", [k] {
      TestScene s = box_scene();
      translate(&s.scene, {k, -0.7 * k, 0.3 * k});
      return Setup{s.scene, kDepth, grey(kSeries)};
    }));
  }
  // Floats at 10^7 are whole numbers: a box of 2048 whose vertices are exact.
  cases.push_back(box_case("far from the origin, by vertices", "1e7 units", [] {
    return Setup{box_scene({1e7, -1e7, 1e7}, 1024).scene, kDepth, grey(kSeries)};
  }));
  for (const double half : {0x1p-60, 0x1p60}) {
    cases.push_back(box_case("size of the scene", "2^" + text(std::log2(half)), [half] {
      return Setup{box_scene({}, half).scene, kDepth, grey(kSeries)};
    }));
  }
  for (const double w : {1e-4, 1e-8}) {
    cases.push_back(box_case("slivers in a closed box", "aspect " + text(2 / w), [w] {
      return Setup{sliver_box(w).scene, kDepth, grey(kSeries)};
    }));
  }
  return cases;
}

}  // namespace lightmill::test
