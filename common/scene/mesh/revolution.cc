#include "common/scene/mesh/revolution.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/scene/mesh/grid.h"
#include "common/scene/mesh/mesh_check.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

constexpr int kAround = 256, kAlong = 64;

Vec3f to_float(const Vec3d& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

Vec3d turned(const Vec3d& p, double phi) {
  const double c = std::cos(phi), s = std::sin(phi);
  return {c * p.x - s * p.y, s * p.x + c * p.y, p.z};
}

/// dp/du x dp/dv at angle 0; zero where there is none.
Vec3d normal_at(const std::function<Vec3d(double)>& profile, double v) {
  constexpr double kStep = 1e-4;
  const double at = std::clamp(v, kStep, 1 - kStep);  // off the tip, where dp/du is zero
  const Vec3d p = profile(at), a = profile(at - kStep), b = profile(at + kStep);
  const Vec3d du{-p.y, p.x, 0}, dv{b.x - a.x, b.y - a.y, b.z - a.z};
  const Vec3d n{du.y * dv.z - du.z * dv.y, du.z * dv.x - du.x * dv.z, du.x * dv.y - du.y * dv.x};
  const double length = std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z);
  if (!(length > 0)) return {};
  return {n.x / length, n.y / length, n.z / length};
}

}  // namespace

TriangleMesh revolution_mesh(const std::function<Vec3d(double v)>& profile, double phimax) {
  const double turn = 2 * std::numbers::pi, phi = std::min(phimax, turn);
  const int around = std::max(3, static_cast<int>(std::ceil(kAround * phi / turn)));
  TriangleMesh mesh;
  for (int j = 0; j <= kAlong; ++j) {
    const double v = static_cast<double>(j) / kAlong;
    const Vec3d p = profile(v), n = normal_at(profile, v);
    for (int i = 0; i <= around; ++i) {
      const double angle = i == around && phi == turn ? 0 : phi * i / around;
      mesh.positions.push_back(to_float(turned(p, angle)));
      mesh.normals.push_back(to_float(turned(n, angle)));
      mesh.uvs.push_back({static_cast<float>(i) / static_cast<float>(around), static_cast<float>(v)});
    }
  }
  add_grid(around, kAlong, &mesh);
  drop_zero_area_triangles(&mesh);
  mend_zero_normals(&mesh);
  return mesh;
}

TriangleMesh height_field_mesh(int nu, int nv, const std::vector<double>& heights) {
  TriangleMesh mesh;
  for (int j = 0; j < nv; ++j) {
    for (int i = 0; i < nu; ++i) {
      const float u = static_cast<float>(i) / static_cast<float>(nu - 1),
                  v = static_cast<float>(j) / static_cast<float>(nv - 1);
      mesh.positions.push_back(
          {u, v,
           static_cast<float>(
               heights[static_cast<size_t>(j) * static_cast<size_t>(nu) + static_cast<size_t>(i)])});
      mesh.uvs.push_back({u, v});
    }
  }
  add_grid(nu - 1, nv - 1, &mesh);
  return mesh;
}

}  // namespace lightmill
