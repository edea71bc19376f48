#include "common/scene/pbrt/shapes/curves.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/scene/mesh/curve_mesh.h"
#include "common/scene/mesh/tessellate.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

constexpr double kWidest = 1e37;  // as far as positions may go

/// One of `words`; another is reported, and the first one taken.
std::string one_of(ParameterList& params, std::string_view name, const std::vector<std::string_view>& words) {
  std::string word = params.text(name, std::string(words.front()));
  if (std::find(words.begin(), words.end(), word) != words.end()) return word;
  params.odd_value(name, "is unknown: " + in_quotes(word) + nearest_hint(word, words, "") +
                             in_quotes(words.front()) + " is taken");
  return std::string(words.front());
}

std::vector<Vec3d> to_vec3d(const std::vector<double>& v) {
  std::vector<Vec3d> out;
  for (size_t i = 0; i + 2 < v.size(); i += 3) out.push_back({v[i], v[i + 1], v[i + 2]});
  return out;
}

/// The ribbon's normals at the ends of the pieces; empty: reported.
std::vector<Vec3d> read_normals(ParameterList& params, size_t pieces) {
  const auto* numbers = params.numbers("N", ParamType::kNormal);
  if (numbers == nullptr) {
    if (!params.has("N")) params.left_out("of type \"ribbon\" needs \"normal N\"");
    return {};
  }
  std::vector<Vec3d> normals = to_vec3d(*numbers);
  if (normals.size() != pieces + 1) {
    params.left_out("has " + std::to_string(normals.size()) + " normals; the curve needs " +
                    std::to_string(pieces + 1));
    return {};
  }
  for (Vec3d& n : normals) {
    const double size = length(n);
    if (!(size > 0) || !std::isfinite(size)) {
      params.left_out("has a normal without direction");
      return {};
    }
    n = {n.x / size, n.y / size, n.z / size};
  }
  return normals;
}

}  // namespace

std::shared_ptr<TriangleMesh> read_curve(PbrtScene& out, ParameterList& params) {
  const std::string type = one_of(params, "type", {"flat", "ribbon", "cylinder"});
  const std::string basis = one_of(params, "basis", {"bezier", "bspline"});
  const auto degree = static_cast<int>(params.integer("degree", 3, 2, 3));
  const double width = params.number("width", 1, 0, kWidest);
  const double width0 = params.number("width0", width, 0, kWidest);
  const double width1 = params.number("width1", width, 0, kWidest);
  params.accept({"splitdepth"});
  const auto* numbers = params.numbers("P", ParamType::kPoint3);
  if (numbers == nullptr) {
    if (!params.has("P")) params.left_out("needs \"point3 P\"");
    return nullptr;
  }
  const std::vector<Vec3d> points = to_vec3d(*numbers);
  const size_t order = static_cast<size_t>(degree) + 1;
  if (points.size() < order) {
    params.left_out("has " + std::to_string(points.size()) + " points; a curve of degree " +
                    std::to_string(degree) + " needs at least " + std::to_string(order));
    return nullptr;
  }
  if (basis == "bezier" && (points.size() - 1) % (order - 1) != 0) {
    params.left_out("has " + std::to_string(points.size()) + " points; Bezier curves of degree " +
                    std::to_string(degree) + " need " + std::to_string(order) + ", " +
                    std::to_string(2 * order - 1) + ", " + std::to_string(3 * order - 2) + ", ...");
    return nullptr;
  }
  if (!(static_cast<float>(std::max(width0, width1)) > 0)) {
    params.left_out(std::string("has a \"") + (params.has("width0") ? "width0" : "width") +
                    "\" that is not above 0 at either end of the curve");
    return nullptr;
  }
  BezierChain chain;
  if (basis == "bezier") {
    chain.degree = degree;
    chain.points = points;
  } else {
    chain = from_bspline(degree, points);
  }
  chain.width0 = width0;
  chain.width1 = width1;
  if (type == "ribbon") {
    chain.normals = read_normals(params, chain.pieces());
    if (chain.normals.empty()) return nullptr;
  } else {
    params.accept({"N"});
  }
  auto mesh = std::make_shared<TriangleMesh>(curve_mesh(chain));
  mesh->flat = type == "flat";
  if (mesh->triangles.empty() && !std::exchange(out.named_empty_curves, true)) {
    out.problems->warning(params.where(), params.owner() + " has no length and is left out (said once)");
  }
  if (mesh->triangles.empty() || !out.may_generate(mesh->triangles.size(), params)) return nullptr;
  return mesh;
}

bool join_curves(PbrtScene& out, const ShapeDescription& curve) {
  constexpr size_t kMostTriangles = size_t{1} << 20;  // of one mesh
  if (out.open_curves == nullptr || out.scene.shapes.empty()) return false;
  const ShapeDescription& last = out.scene.shapes.back();
  const auto* before = std::get_if<MeshShape>(&last.kind);
  const TriangleMesh &open = *out.open_curves, &mesh = *std::get<MeshShape>(curve.kind).mesh;
  const bool joins = before != nullptr && before->mesh == out.open_curves && open.flat == mesh.flat &&
                     open.tube == mesh.tube && curve.area_light < 0 && last.material == curve.material &&
                     last.media == curve.media && last.reverse_orientation == curve.reverse_orientation &&
                     last.object_to_world.m == curve.object_to_world.m && last.moves_to == curve.moves_to &&
                     last.names == curve.names && out.open_curves->triangles.size() < kMostTriangles;
  if (joins) append_mesh(out.open_curves.get(), *std::get<MeshShape>(curve.kind).mesh);
  return joins;
}

}  // namespace lightmill
