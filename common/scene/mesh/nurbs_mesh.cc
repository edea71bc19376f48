// After Piegl and Tiller, The NURBS Book, sections 2.5 and 4.5.
#include "common/scene/mesh/nurbs_mesh.h"

#include <algorithm>
#include <cmath>

#include "common/scene/mesh/grid.h"
#include "common/scene/mesh/mesh_check.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

size_t index_of(int i) { return static_cast<size_t>(i); }

/// The basis functions that are not 0 at `t`, and their derivatives: those of the control points from `first`
/// on.
struct Basis {
  int first = 0;
  std::vector<double> values, derivatives;
};

/// The values of degree `degree` of the span: N(span - degree) to N(span).
std::vector<double> basis_values(const std::vector<double>& knots, int span, int degree, double t) {
  std::vector<double> n(index_of(degree) + 1, 0.0);
  n[0] = 1;
  for (int d = 1; d <= degree; ++d) {
    double saved = 0;
    for (int r = 0; r < d; ++r) {
      const double right = knots[index_of(span + r + 1)], left = knots[index_of(span + 1 + r - d)];
      const double term = n[index_of(r)] / (right - left);
      n[index_of(r)] = saved + (right - t) * term;
      saved = (t - left) * term;
    }
    n[index_of(d)] = saved;
  }
  return n;
}

Basis basis_at(const NurbsDirection& d, double t) {
  // The span that holds t, the last one with a length for the end itself.
  const auto first = d.knots.begin() + d.order - 1, last = d.knots.begin() + d.points;
  auto above = std::upper_bound(first, last, t);
  while (*above <= *(above - 1)) --above;
  const int span = static_cast<int>(above - d.knots.begin()) - 1, degree = d.order - 1;
  Basis b;
  b.first = span - degree;
  b.values = basis_values(d.knots, span, degree, t);
  const std::vector<double> lower = basis_values(d.knots, span, degree - 1, t);
  for (int i = 0; i <= degree; ++i) {
    const auto part = [&](int j) {  // N(first + j) of the lower degree over its width
      if (j < 1 || j > degree) return 0.0;
      const int k = b.first + j;
      return lower[index_of(j - 1)] / (d.knots[index_of(k + degree)] - d.knots[index_of(k)]);
    };
    b.derivatives.push_back(degree * (part(i) - part(i + 1)));
  }
  return b;
}

int segments_of(const NurbsDirection& d) { return std::clamp(8 * (d.points - d.order + 1), 32, 256); }

Vec3f to_vec3f(const Vec3d& p) {
  return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

}  // namespace

bool NurbsDirection::has_knots() const {
  return order >= 2 && points >= order && knots.size() == index_of(points) + index_of(order) &&
         std::ranges::is_sorted(knots);
}

TriangleMesh nurbs_mesh(const NurbsDirection& u, const NurbsDirection& v,
                        const std::vector<std::array<double, 4>>& control_points) {
  const int nu = segments_of(u), nv = segments_of(v);
  const auto along = [](const NurbsDirection& d, int i, int n) {
    return d.begin + (d.end - d.begin) * i / n;
  };
  std::vector<Basis> columns;
  for (int i = 0; i <= nu; ++i) columns.push_back(basis_at(u, along(u, i, nu)));
  TriangleMesh mesh;
  for (int j = 0; j <= nv; ++j) {
    const Basis row = basis_at(v, along(v, j, nv));
    for (int i = 0; i <= nu; ++i) {
      const Basis& column = columns[index_of(i)];
      std::array<double, 4> s{}, du{}, dv{};
      for (int b = 0; b < v.order; ++b) {
        for (int a = 0; a < u.order; ++a) {
          const auto& p =
              control_points[index_of(row.first + b) * index_of(u.points) + index_of(column.first + a)];
          for (size_t k = 0; k < 4; ++k) {
            s[k] += p[k] * column.values[index_of(a)] * row.values[index_of(b)];
            du[k] += p[k] * column.derivatives[index_of(a)] * row.values[index_of(b)];
            dv[k] += p[k] * column.values[index_of(a)] * row.derivatives[index_of(b)];
          }
        }
      }
      const Vec3d at{s[0] / s[3], s[1] / s[3], s[2] / s[3]};
      // The quotient rule, but for a factor of 1 / w.
      const auto tangent = [&](const std::array<double, 4>& d) {
        return Vec3d{d[0] - at.x * d[3], d[1] - at.y * d[3], d[2] - at.z * d[3]};
      };
      const Vec3d a = tangent(du), b = tangent(dv);
      const Vec3d n{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
      const double size = length(n);
      mesh.positions.push_back(to_vec3f(at));
      mesh.normals.push_back(size > 0 ? to_vec3f({n.x / size, n.y / size, n.z / size}) : Vec3f{});
      mesh.uvs.push_back({static_cast<float>(along(u, i, nu)), static_cast<float>(along(v, j, nv))});
    }
  }
  add_grid(nu, nv, &mesh);
  return mesh;
}

}  // namespace lightmill
