#include "common/scene/pbrt/v3/shapes.h"

#include <array>
#include <cmath>
#include <numbers>

#include "common/base/error.h"
#include "common/scene/mesh/mesh_check.h"
#include "common/scene/mesh/nurbs_mesh.h"
#include "common/scene/mesh/revolution.h"

namespace lightmill::v3 {
namespace {

constexpr int64_t kMostHeights = 4096;  // a side of a height field

double read_angle(ParameterList& params) {
  const double phi = params.number("phimax", 360, 0, 360);
  return (phi > 0 ? phi : 360) * std::numbers::pi / 180;
}

Vec3d read_point(ParameterList& params, const char* name, const Vec3d& fallback) {
  const auto* p = params.numbers(name, ParamType::kPoint3, 3);
  return p == nullptr ? fallback : Vec3d{(*p)[0], (*p)[1], (*p)[2]};
}

std::optional<TriangleMesh> read_height_field(ParameterList& params) {
  const int64_t nu = params.integer("nu", 2, 2, kMostHeights), nv = params.integer("nv", 2, 2, kMostHeights);
  const auto* heights = params.numbers("Pz", ParamType::kFloat);
  if (heights == nullptr || static_cast<int64_t>(heights->size()) != nu * nv) {
    params.left_out("needs nu x nv numbers \"Pz\"");
    return std::nullopt;
  }
  return height_field_mesh(static_cast<int>(nu), static_cast<int>(nv), *heights);
}

/// Names of the parameters of one direction of a NURBS surface.
struct NurbsNames {
  const char *points, *order, *knots, *begin, *end;
};

std::optional<NurbsDirection> read_nurbs_direction(ParameterList& params, const NurbsNames& names) {
  constexpr int64_t kMostPoints = 4096, kHighestOrder = 32;
  NurbsDirection d;
  d.points = static_cast<int>(params.integer(names.points, 0, 0, kMostPoints));
  d.order = static_cast<int>(params.integer(names.order, 0, 0, kHighestOrder));
  if (const auto* knots = params.numbers(names.knots, ParamType::kFloat)) d.knots = *knots;
  params.accept({names.begin, names.end});
  if (d.has_knots()) {
    const double low = d.knots[static_cast<size_t>(d.order) - 1],
                 high = d.knots[static_cast<size_t>(d.points)];
    d.begin = params.number(names.begin, low, low, high);
    d.end = params.number(names.end, high, low, high);
    if (d.begin < d.end) return d;
  }
  params.left_out("needs the number " + in_quotes(names.points) +
                  " of its points, an order of at least 2, and " + "as many " + in_quotes(names.knots) +
                  " as both together, which never decrease");
  return std::nullopt;
}

std::optional<TriangleMesh> read_nurbs(ParameterList& params) {
  const auto u = read_nurbs_direction(params, {"nu", "uorder", "uknots", "u0", "u1"}),
             v = read_nurbs_direction(params, {"nv", "vorder", "vknots", "v0", "v1"});
  const bool weighted = params.has("Pw");
  const auto* p =
      weighted ? params.numbers("Pw", ParamType::kFloat) : params.numbers("P", ParamType::kPoint3);
  if (!u || !v) return std::nullopt;
  const size_t each = weighted ? 4 : 3,
               count = static_cast<size_t>(u->points) * static_cast<size_t>(v->points);
  if (p == nullptr || p->size() != each * count) {
    params.left_out("needs nu x nv points \"P\", or \"Pw\" of four numbers each");
    return std::nullopt;
  }
  std::vector<std::array<double, 4>> points;
  for (size_t i = 0; i < p->size(); i += each)
    points.push_back({(*p)[i], (*p)[i + 1], (*p)[i + 2], weighted ? (*p)[i + 3] : 1});
  TriangleMesh mesh = nurbs_mesh(*u, *v, points);
  try {
    require_valid_mesh(mesh);
  } catch (const Error& e) {
    params.left_out(e.what());
    return std::nullopt;
  }
  drop_zero_area_triangles(&mesh);
  mend_zero_normals(&mesh);
  return mesh;
}

}  // namespace

bool is_shape(const std::string& type) {
  return type == "cone" || type == "paraboloid" || type == "hyperboloid" || type == "heightfield" ||
         type == "nurbs";
}

std::optional<ReadShape> read_shape(const std::string& type, PbrtScene& out, ParameterList& params) {
  std::optional<TriangleMesh> mesh;
  if (type == "heightfield") {
    mesh = read_height_field(params);
  } else if (type == "nurbs") {
    mesh = read_nurbs(params);
  } else if (type == "hyperboloid") {
    const Vec3d a = read_point(params, "p1", {0, 0, 0}), b = read_point(params, "p2", {1, 1, 1});
    const auto line = [&](double v) {
      return Vec3d{(1 - v) * a.x + v * b.x, (1 - v) * a.y + v * b.y, (1 - v) * a.z + v * b.z};
    };
    mesh = revolution_mesh(line, read_angle(params));
  } else {
    const double radius = params.number("radius", 1, 1e-30, kAnySize);
    const double phi = read_angle(params);
    if (type == "cone") {
      const double height = params.number("height", 1, -kAnySize, kAnySize);
      mesh = revolution_mesh([&](double v) { return Vec3d{radius * (1 - v), 0, height * v}; }, phi);
    } else {
      const double low = params.number("zmin", 0, 0, kAnySize),
                   high = params.number("zmax", 1, 1e-30, kAnySize);
      mesh = revolution_mesh(
          [&](double v) {
            const double z = low + (high - low) * v;
            return Vec3d{radius * std::sqrt(std::max(z, 0.0) / std::max(low, high)), 0, z};
          },
          phi);
    }
  }
  if (!mesh || !out.may_generate(mesh->triangles.size(), params)) return std::nullopt;
  const size_t emitters = mesh->triangles.size();
  return ReadShape{MeshShape{std::make_shared<const TriangleMesh>(std::move(*mesh))}, emitters};
}

}  // namespace lightmill::v3
