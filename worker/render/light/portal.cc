#include "worker/render/light/portal.h"

#include <algorithm>
#include <cmath>

namespace lightmill {
namespace {

Vec3d minus(const Vec3d& a, const Vec3d& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
double squared(const Vec3d& v) { return v.x * v.x + v.y * v.y + v.z * v.z; }
Vec3f rounded(const Vec3d& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

}  // namespace

Portal make_portal(const std::array<Vec3d, 4>& corners, const float center[3], float radius) {
  const Vec3d e1 = minus(corners[1], corners[0]), e2 = minus(corners[3], corners[0]);
  const Vec3d n{e2.y * e1.z - e2.z * e1.y, e2.z * e1.x - e2.x * e1.z, e2.x * e1.y - e2.y * e1.x};
  const double area = std::sqrt(squared(n));
  double farthest = 0;
  for (const Vec3d& c : corners) {
    farthest =
        std::max(farthest, squared(minus(c, {double{center[0]}, double{center[1]}, double{center[2]}})));
  }
  Portal p;
  p.corner = rounded(corners[0]);
  p.edge1 = rounded(e1);
  p.edge2 = rounded(e2);
  p.normal = rounded({n.x / area, n.y / area, n.z / area});
  p.length1_squared = static_cast<float>(squared(e1));
  p.length2_squared = static_cast<float>(squared(e2));
  p.area = static_cast<float>(area);
  p.reach = radius + static_cast<float>(std::sqrt(farthest));
  return p;
}

}  // namespace lightmill
