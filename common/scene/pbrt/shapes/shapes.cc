// Shape, and how it takes over the material and the area light in force.
#include "common/scene/pbrt/v3/shapes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/error.h"
#include "common/scene/mesh/loop_subdivision.h"
#include "common/scene/mesh/mesh_check.h"
#include "common/scene/pbrt/scene.h"
#include "common/scene/pbrt/shapes/curves.h"
#include "common/scene/pbrt/shapes/quadrics.h"
#include "common/scene/spectrum/spectrum.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

const std::vector<std::string_view> kKnownShapes = {"trianglemesh", "plymesh",      "sphere", "disk",
                                                    "cylinder",     "bilinearmesh", "curve",  "loopsubdiv"};

void warn_of_cleaning(size_t dropped_triangles, size_t mended_normals, const std::string& what,
                      const SourceLocation& where, ProblemList* problems) {
  if (dropped_triangles > 0) {
    problems->warning(where, what + " has " + std::to_string(dropped_triangles) +
                                 " triangles without area; they are left out");
  }
  if (mended_normals > 0) {
    problems->warning(where, what + " has " + std::to_string(mended_normals) +
                                 " normals without direction; they are taken from the triangles");
  }
}

/// Drops what has no area and mends normals, with one warning each.
void clean(TriangleMesh* mesh, const std::string& what, const SourceLocation& where, ProblemList* problems) {
  const size_t dropped = drop_zero_area_triangles(mesh);
  warn_of_cleaning(dropped, mend_zero_normals(mesh), what, where, problems);
}

std::vector<Vec3f> to_vec3(const std::vector<double>& v) {
  std::vector<Vec3f> out(v.size() / 3);
  for (size_t i = 0; i < out.size(); ++i) {
    out[i] = {static_cast<float>(v[3 * i]), static_cast<float>(v[3 * i + 1]),
              static_cast<float>(v[3 * i + 2])};
  }
  return out;
}

/// Positions and triangles from "P" and "indices"; false: reported.
bool read_triangles(ParameterList& params, TriangleMesh* mesh) {
  const auto* positions = params.numbers("P", ParamType::kPoint3);
  const auto* indices = params.numbers("indices", ParamType::kInteger);
  if (positions == nullptr) {
    if (!params.has("P")) params.left_out("needs \"point3 P\"");
    return false;
  }
  mesh->positions = to_vec3(*positions);
  if (indices == nullptr) {
    if (params.has("indices")) return false;  // reported
    if (mesh->positions.size() != 3) {
      params.left_out("needs \"integer indices\" unless it is one triangle");
      return false;
    }
    mesh->triangles.push_back({0, 1, 2});
    return true;
  }
  if (indices->size() % 3 != 0) {
    params.odd_value("indices", "has " + std::to_string(indices->size()) +
                                    " numbers; it needs 3 per triangle; the last are left out");
  }
  if (std::ranges::any_of(*indices, [](double i) { return i < 0; })) {
    params.left_out("has a negative index");
    return false;
  }
  for (size_t i = 0; i + 2 < indices->size(); i += 3) {
    const auto at = [&](size_t k) { return static_cast<uint32_t>((*indices)[i + k]); };
    mesh->triangles.push_back({at(0), at(1), at(2)});
  }
  return true;
}

std::shared_ptr<const TriangleMesh> read_triangle_mesh(PbrtScene& out, ParameterList& params) {
  auto mesh = std::make_shared<TriangleMesh>();
  const auto* normals = params.numbers("N", ParamType::kNormal);
  const auto* uvs = params.numbers("uv", ParamType::kPoint2);
  params.accept({"S", "faceIndices"});
  if (!read_triangles(params, mesh.get())) return nullptr;
  if (normals != nullptr) mesh->normals = to_vec3(*normals);
  if (uvs != nullptr) {
    for (size_t i = 0; i + 1 < uvs->size(); i += 2) {
      mesh->uvs.push_back({static_cast<float>((*uvs)[i]), static_cast<float>((*uvs)[i + 1])});
    }
  }
  try {
    require_valid_mesh(*mesh);
  } catch (const Error& e) {
    params.left_out(e.what());
    return nullptr;
  }
  clean(mesh.get(), params.owner(), params.where(), out.problems);
  return mesh;
}

std::shared_ptr<const TriangleMesh> read_loop_subdivision(PbrtScene& out, ParameterList& params) {
  constexpr int kMaxLevels = 11;  // of which one triangle has kMaxSubdividedTriangles
  const auto levels = static_cast<int>(params.integer("levels", 3, 0, kMaxLevels));
  params.accept({"scheme"});
  TriangleMesh control;
  if (!read_triangles(params, &control)) return nullptr;
  std::shared_ptr<TriangleMesh> mesh;
  try {
    require_valid_mesh(control);
    if (!out.may_generate(subdivided_count(control, levels), params)) return nullptr;
    mesh = std::make_shared<TriangleMesh>(loop_subdivide(control, levels));
  } catch (const Error& e) {
    params.left_out(e.what());
    return nullptr;
  }
  clean(mesh.get(), params.owner(), params.where(), out.problems);
  return mesh;
}

/// A PLY file, cleaned; an empty pointer if it can't be read (reported).
std::shared_ptr<TriangleMesh> read_ply_file(PbrtScene& out, const std::string& file, const std::string& path,
                                            const SourceLocation& where) {
  try {
    CleanMesh read = out.read_ahead.take(path);
    warn_of_cleaning(read.dropped_triangles, read.mended_normals, "the mesh " + in_quotes(file), where,
                     out.problems);
    return std::make_shared<TriangleMesh>(std::move(read.mesh));
  } catch (const Error& e) {
    out.problems->error(where, "the mesh " + in_quotes(file) + " " + e.what());
  } catch (const std::bad_alloc&) {
    out.problems->error(where, "the mesh " + in_quotes(file) + " does not fit into memory");
  }
  return nullptr;
}

/// "later" (ours): files of the mesh's vertices at even times while the shutter is open, the last at its
/// closing. False: reported, and nothing is taken.
bool read_later_steps(PbrtScene& out, ParameterList& params, TriangleMesh* mesh) {
  constexpr size_t kMostSteps = 64;
  const Parameter* given = params.find("later", {ParamType::kString});
  if (given == nullptr) return true;
  const std::vector<std::string> files = given->strings;
  const SourceLocation where = params.where_of("later");
  if (files.empty() || files.size() > kMostSteps || (files.size() & (files.size() - 1)) != 0) {
    params.odd_value("later", "needs 1, 2, 4, ... files, up to 64; the mesh does not bend");
    return false;
  }
  for (const std::string& file : files) {
    const std::string path = out.open_mesh(file, where);
    if (path.empty()) return false;
    const auto step = read_ply_file(out, file, path, where);
    if (step == nullptr) return false;
    if (step->positions.size() != mesh->positions.size() || step->normals.size() != mesh->normals.size()) {
      params.odd_value("later",
                       "has other vertices than the mesh: " + in_quotes(file) + "; the mesh does not bend");
      mesh->later.clear();
      return false;
    }
    mesh->later.push_back({std::move(step->positions), std::move(step->normals)});
  }
  return true;
}

std::shared_ptr<const TriangleMesh> read_ply_mesh(PbrtScene& out, ParameterList& params) {
  const std::string file = params.text("filename", "");
  const SourceLocation where = params.where_of("filename");
  if (file.empty()) {
    out.problems->error(where, params.owner() + " needs a \"string filename\"");
    return nullptr;
  }
  const std::string path = out.open_mesh(file, where);
  if (path.empty()) return nullptr;
  // Also null: a broken file is reported once.
  auto [found, is_new] = out.meshes.try_emplace(path);
  if (is_new) found->second = read_ply_file(out, file, path, where);
  if (found->second == nullptr || !params.has("later")) return found->second;
  auto bent = std::make_shared<TriangleMesh>(*found->second);
  return read_later_steps(out, params, bent.get()) ? bent : found->second;
}

/// "displacement" and "edgelength" of a PLY mesh.
void read_displacement(PbrtScene& out, ParameterList& params, ShapeDescription* shape) {
  if (!params.has("displacement")) {
    params.accept({"edgelength"});
    return;
  }
  constexpr double kMost = 1e18;
  shape->displacement = out.float_input(params, "displacement", 0, -kMost, kMost);
  shape->edge_length =
      static_cast<float>(params.number("edgelength", 1, 0, kMost) * out.displacement_edge_scale);
  if (params.has("later")) {
    params.odd_value("displacement", "is of a mesh that bends, which is not displaced");
    shape->displacement = {};
  }
}

/// Area after the transform. A sphere's is that of its mean scale: exact when the scale is uniform.
double area_of(const ShapeDescription& shape) {
  if (const auto* mesh = std::get_if<MeshShape>(&shape.kind))
    return mesh_area(*mesh->mesh, shape.object_to_world);
  const double r = std::get<SphereShape>(shape.kind).radius;
  return 4 * std::numbers::pi * r * r * std::pow(std::abs(determinant3(shape.object_to_world)), 2.0 / 3.0);
}

/// Index of the area light that the shape takes over.
int take_area_light(PbrtScene& out, const ShapeDescription& shape, size_t emitters,
                    PendingAreaLight& pending) {
  auto& lights = out.scene.area_lights;
  if (pending.image_path && pending.texture < 0) {
    ImageTexture image;
    image.path = *pending.image_path;
    image.wrap = Wrap::kClamp;
    pending.texture = static_cast<int>(out.scene.textures.size());
    out.scene.textures.push_back({"", true, image, pending.image_where});
  }
  if (pending.power > 0) {
    // pbrt makes every triangle a light of its own with the whole power, so a mesh of n triangles emits n
    // times as much; each here has the mean radiance.
    const double flux_per_radiance = (pending.two_sided ? 2 : 1) * std::numbers::pi * area_of(shape);
    const double scale = pending.power * static_cast<double>(emitters) / flux_per_radiance;
    const auto f = [&](float x) {
      const auto y = static_cast<float>(x * scale);
      if (std::isfinite(y)) return y;
      out.problems->error(shape.location,
                          "the shape is so small that its area light's \"power\" makes it "
                          "brighter than float can hold; lower it");
      return 0.0f;
    };
    lights.push_back({{f(pending.radiance.r), f(pending.radiance.g), f(pending.radiance.b)},
                      pending.two_sided,
                      pending.where,
                      pending.texture,
                      pending.texture >= 0,
                      pending.light_group});
    return static_cast<int>(lights.size()) - 1;
  }
  if (pending.index < 0) {
    pending.index = static_cast<int>(lights.size());
    lights.push_back(
        {pending.radiance, pending.two_sided, pending.where, pending.texture, false, pending.light_group});
  }
  return pending.index;
}

/// Of what lies at `object_to_world`.
bool extent_is_finite(const ShapeDescription& shape, const Transform& object_to_world) {
  const auto fits = [&](const Vec3d& p) {
    const Vec3d q = transform_point(object_to_world, p);
    constexpr double kLimit = 1e37;  // squared distances are formed in double, positions kept in float
    return std::abs(q.x) < kLimit && std::abs(q.y) < kLimit && std::abs(q.z) < kLimit;
  };
  if (const auto* sphere = std::get_if<SphereShape>(&shape.kind)) {
    const double r = sphere->radius;
    return fits({r, r, r}) && fits({-r, -r, -r});
  }
  const auto& positions = std::get<MeshShape>(shape.kind).mesh->positions;
  return std::all_of(positions.begin(), positions.end(), [&](const Vec3f& p) {
    return fits({p.x, p.y, p.z});
  });
}

}  // namespace

void translate_shape(PbrtScene& out, const std::string& type, ParameterList& params,
                     const ShapeAttributes& attributes) {
  ShapeDescription shape;
  shape.object_to_world = attributes.ctm;
  shape.moves_to = attributes.moves_to;
  shape.reverse_orientation = attributes.reverse_orientation;
  shape.location = params.where();
  shape.media = attributes.media;
  // Constants are within [0, 1]; a texture's values are cut to that where they are used.
  shape.alpha = out.float_input(params, "alpha", 1, 0, 1);
  if (const auto opacity = out.opacities.find(attributes.material);
      opacity != out.opacities.end() && !params.has("alpha"))
    shape.alpha = opacity->second;
  shape.hidden = hidden_from(params);
  shape.names = part_names_from(params, &out.scene);
  const bool plain_curve = type == "curve" && shape.alpha.texture < 0 && shape.alpha.value == 1 &&
                           attributes.area_light == nullptr && shape.hidden == 0;
  size_t emitters = 1;
  std::shared_ptr<TriangleMesh> curve;
  if (type == "trianglemesh" || type == "plymesh" || type == "loopsubdiv") {
    if (type == "plymesh") read_displacement(out, params, &shape);
    auto mesh = type == "plymesh"        ? read_ply_mesh(out, params)
                : type == "trianglemesh" ? read_triangle_mesh(out, params)
                                         : read_loop_subdivision(out, params);
    params.finish();
    if (mesh == nullptr) return;
    emitters = mesh->triangles.size();
    shape.kind = MeshShape{std::move(mesh)};
  } else if (type == "sphere" || type == "disk" || type == "cylinder" || type == "bilinearmesh" ||
             v3::is_shape(type)) {
    auto read = v3::is_shape(type)   ? v3::read_shape(type, out, params)
                : type == "sphere"   ? read_sphere(out, params)
                : type == "disk"     ? read_disk(out, params)
                : type == "cylinder" ? read_cylinder(out, params)
                                     : read_bilinear_mesh(out, params);
    params.finish();
    if (!read) return;
    emitters = read->emitters;
    shape.kind = std::move(read->kind);
    // A mirror turns the normals of pbrt's quadrics, and those of its meshes not; exporters undo it by
    // ReverseOrientation. Points of light on quadrics face away from this in pbrt, so emitters are left
    // alone.
    if (type != "bilinearmesh" && attributes.area_light == nullptr && determinant3(attributes.ctm) < 0)
      shape.reverse_orientation = !shape.reverse_orientation;
  } else if (type == "curve") {
    curve = read_curve(out, params);
    params.finish();
    if (curve == nullptr) return;
    shape.kind = MeshShape{curve};
  } else {
    report_unknown_word(params, "shape", type, kKnownShapes, "it is left out");
    return;
  }
  if (const auto* mesh = std::get_if<MeshShape>(&shape.kind);
      mesh != nullptr && mesh->mesh->triangles.empty()) {
    out.problems->warning(params.where(), params.owner() + " has no triangle with area; it is left out");
    return;
  }
  // Every ray passes: there is nothing, but light if it emits.
  if (shape.alpha.texture < 0 && shape.alpha.value == 0 && attributes.area_light == nullptr) return;
  if (!extent_is_finite(shape, shape.object_to_world) ||
      (shape.moves_to >= 0 &&
       !extent_is_finite(shape, out.scene.later[static_cast<size_t>(shape.moves_to)]))) {
    params.left_out("lies outside the range of numbers; check its transform");
    return;
  }
  shape.material = attributes.material >= 0 ? attributes.material : out.default_material(params.where());
  if (attributes.area_light != nullptr)
    shape.area_light = take_area_light(out, shape, emitters, *attributes.area_light);
  if (plain_curve && join_curves(out, shape)) return;
  out.open_curves = plain_curve ? curve : nullptr;
  out.scene.shapes.push_back(std::move(shape));
}

}  // namespace lightmill
