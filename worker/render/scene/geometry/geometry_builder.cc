#include "worker/render/scene/geometry/geometry_builder.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/error.h"
#include "common/scene/texture_graph/texture_graph.h"
#include "worker/render/scene/geometry/alpha_mask.h"
#include "worker/render/scene/materials/bump.h"

namespace lightmill {
namespace {

/// Of an emitter in normalised space: densities per area stay within float.
constexpr double kLeastLightArea = 1e-36;

}  // namespace

void GeometryBuilder::reserve(const std::vector<const ShapeDescription*>& shapes, const PartsInUse& parts) {
  size_t vertices = 0, triangles = 0, spheres = 0;
  bool normals = false, uvs = false, second_uvs = false, colors = false, read_uvs = false;
  for (const ShapeDescription* shape : shapes) {
    const ShapeDescription& s = *shape;
    if (const auto* mesh = std::get_if<MeshShape>(&s.kind)) {
      vertices += mesh->mesh->positions.size() * (1 + mesh->mesh->later.size());
      triangles += mesh->mesh->triangles.size();
      normals = normals || !mesh->mesh->normals.empty();
      uvs = uvs || !mesh->mesh->uvs.empty();
      out_.any_fibres = out_.any_fibres || is_of_fibres(s);
      read_uvs = read_uvs || is_of_fibres(s) || s.alpha.texture >= 0 ||
                 (s.area_light >= 0 && in_.area_lights[static_cast<size_t>(s.area_light)].texture >= 0);
      colors = colors || !mesh->mesh->colors.empty();
      second_uvs = second_uvs || !mesh->mesh->second_uvs.empty();
    } else {
      ++spheres;
    }
  }
  if (vertices > size_t{1} << 29 || triangles > size_t{1} << 29) {
    throw Error(ErrorKind::kBadScene,
                "the scene has more than 2^29 vertices or triangles, which is the limit");
  }
  normals = normals || out_.overrides & kShadingNormals;
  out_.any_normals = normals;
  out_.positions.reserve(3 * vertices + 4);
  if (normals) out_.normals.reserve(3 * vertices);
  for (size_t i = 0; i < out_.materials.size(); ++i) {
    const MaterialEntry& m = out_.materials[i];
    read_uvs = read_uvs || (parts.materials[i] && (m.textured || has_bumps(m) || anisotropic<float>(m.kind)));
  }
  keep_uvs_ = uvs && read_uvs;
  keep_uvs_ = keep_uvs_ || out_.overrides & kTextureCoordinates;
  if (keep_uvs_) out_.uvs.reserve(2 * vertices);
  bool read_colors = false, read_second_uvs = false;
  for (size_t i = 0; i < in_.textures.size(); ++i) {
    if (!parts.textures[i]) continue;
    const TextureKind& kind = in_.textures[i].kind;
    const auto* graph = std::get_if<GraphTexture>(&kind);
    const auto* image = std::get_if<ImageTexture>(&kind);
    read_colors = read_colors || std::holds_alternative<VertexColorTexture>(kind) ||
                  (graph && reads_colors(*graph->graph));
    read_second_uvs =
        read_second_uvs || (image && image->second_uvs) || (graph && reads_second_uvs(*graph->graph));
  }
  out_.any_second_uvs = second_uvs && read_second_uvs;
  out_.any_colors = colors && read_colors;
  out_.indices.reserve(3 * triangles);
  out_.primitive_material.reserve(triangles + spheres);
  out_.primitive_light.reserve(triangles + spheres);
  out_.primitive_flags.reserve(triangles + spheres);
  used_.assign(out_.materials.size(), false);
}

void GeometryBuilder::add_meshes(const std::vector<const ShapeDescription*>& shapes) {
  std::vector<const ShapeDescription*> meshes;
  std::vector<PlacedMesh> placed;
  for (const ShapeDescription* s : shapes) {
    const auto* shape = std::get_if<MeshShape>(&s->kind);
    if (!shape) continue;
    meshes.push_back(s);
    placed.push_back({shape->mesh.get(), out_.positions.size() / 3, file_rounding(*s, space_)});
    add_vertices(*s, *shape->mesh);
  }
  const std::vector<FaceId> left_out = separate(meshes, placed);
  for (uint32_t i = 0; i < meshes.size(); ++i) {
    const auto begin = std::lower_bound(left_out.begin(), left_out.end(), FaceId{i, 0}),
               end = std::lower_bound(begin, left_out.end(), FaceId{i + 1, 0});
    add_mesh(*meshes[i], placed[i], {begin, end});
  }
}

std::vector<FaceId> GeometryBuilder::separate(const std::vector<const ShapeDescription*>& shapes,
                                              const std::vector<PlacedMesh>& meshes) {
  std::vector<PlacedMesh> met = meshes;  // that rays can meet, as what they are
  std::vector<SurfaceTraits> traits;
  for (size_t i = 0; i < shapes.size(); ++i) {
    traits.push_back(surface_traits(in_, *shapes[i]));
    // What bends lies on other surfaces but for moments.
    if (is_of_fibres(*shapes[i]) || is_unseen_emitter(*shapes[i]) || bends_here(*shapes[i]))
      met[i].mesh = nullptr;
  }
  CoincidentFaces found = separate_faces(met, traits, out_.any_normals ? out_.normals.data() : nullptr,
                                         coincidence_, out_.positions.data());
  note(found, &faces_on_others_);
  return std::move(found.left_out);
}

void GeometryBuilder::add_spheres(const std::vector<const ShapeDescription*>& shapes) {
  std::vector<const ShapeDescription*> with;
  std::vector<PlacedSphere> spheres;
  std::vector<SurfaceTraits> traits;
  for (const ShapeDescription* s : shapes) {
    const auto* sphere = std::get_if<SphereShape>(&s->kind);
    if (!sphere) continue;
    const PlacedSphere placed = placed_sphere(*s, *sphere);
    if (!(placed.record[3] > 0)) continue;
    with.push_back(s);
    spheres.push_back(placed);
    traits.push_back(surface_traits(in_, *s));
  }
  note(separate_spheres(traits, coincidence_, &spheres), &spheres_on_others_);
  for (size_t i = 0; i < with.size(); ++i) {
    if (spheres[i].record[3] > 0) add_sphere(*with[i], spheres[i].record);
  }
}

void GeometryBuilder::note(const CoincidentFaces& found, size_t* count) {
  *count += found.faces;
  moved_ = std::max(moved_, found.moved);
  coincident_.insert(coincident_.end(), found.shapes.begin(), found.shapes.end());
}

void GeometryBuilder::report() {
  if (coincident_.empty()) return;
  out_.warnings.push_back({coincident_.front(), Severity::kWarning,
                           describe_coincidence(faces_on_others_, spheres_on_others_, coincident_)});
}

void GeometryBuilder::surround_lights(int32_t sides) {
  if (media_.any()) out_.lights.media.resize(static_cast<size_t>(out_.lights.count()), sides);
}

void GeometryBuilder::warn(const ShapeDescription& s, std::string what) {
  out_.warnings.push_back({s.location, Severity::kWarning, std::move(what)});
}

void GeometryBuilder::add_primitive(const ShapeDescription& s, int32_t light, int32_t flags) {
  out_.primitive_material.push_back(s.material);
  out_.primitive_light.push_back(light);
  const bool pane = media_.any() && media_.is_pane(s);
  out_.primitive_flags.push_back(flags | (pane ? RenderScene::kPane : 0));
  if (!media_.any()) return;
  out_.primitive_media.push_back(media_.sides(s));
  out_.any_panes = out_.any_panes || pane;
  out_.any_boundaries = out_.any_boundaries || pane || s.boundary;
}

void GeometryBuilder::add_vertices(const ShapeDescription& s, const TriangleMesh& mesh) {
  add_block(s, mesh, mesh.positions, mesh.normals);
  if (!bends_here(s)) return;
  for (const MeshStep& step : mesh.later) add_block(s, mesh, step.positions, step.normals);
}

void GeometryBuilder::add_block(const ShapeDescription& s, const TriangleMesh& mesh,
                                const std::vector<Vec3f>& positions, const std::vector<Vec3f>& normals) {
  const Matrix& m = s.object_to_world.m;
  for (const Vec3f& v : positions) {
    const Vec3d p = space_.relative(transform_point(m, v.x, v.y, v.z));
    out_.positions.insert(out_.positions.end(),
                          {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
  }
  if (out_.any_normals) {
    const double sign = s.reverse_orientation ? -1 : 1;
    for (size_t i = 0; i < positions.size(); ++i) {
      Vec3d n;
      if (!normals.empty()) {
        n = transform_normal(m, normals[i].x, normals[i].y, normals[i].z);
        const double length = std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z);
        const double f = length > 0 && std::isfinite(length) ? sign / length : 0;
        n = {n.x * f, n.y * f, n.z * f};
      }
      out_.normals.insert(out_.normals.end(),
                          {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)});
    }
  }
  if (keep_uvs_) {
    for (size_t i = 0; i < positions.size(); ++i) {
      const Vec2f uv = mesh.uvs.empty() ? Vec2f{} : mesh.uvs[i];
      out_.uvs.insert(out_.uvs.end(), {uv.x, uv.y});
    }
  }
  if (out_.any_second_uvs) {
    for (size_t i = 0; i < positions.size(); ++i) {
      const Vec2f uv = mesh.second_uvs.empty() ? Vec2f{} : mesh.second_uvs[i];
      out_.second_uvs.insert(out_.second_uvs.end(), {uv.x, uv.y});
    }
  }
  if (out_.any_colors) {
    for (size_t i = 0; i < positions.size(); ++i) {
      const auto color = mesh.colors.empty() ? std::array<float, 4>{1, 1, 1, 1} : mesh.colors[i];
      out_.colors.insert(out_.colors.end(), color.begin(), color.end());
    }
  }
}

double GeometryBuilder::largest_area(const int32_t* corners, size_t vertices, size_t steps) const {
  double most = 0;
  for (size_t step = 0; step < steps; ++step) {
    const auto shift = static_cast<int32_t>(step * vertices);
    const int32_t i[3] = {corners[0] + shift, corners[1] + shift, corners[2] + shift};
    const double area = triangle_area(rounded_corners(i)).area;
    // Written so that NaN stays.
    if (!(area <= most)) most = area;
  }
  return most;
}

void GeometryBuilder::finish_bends() {
  if (out_.bends.empty()) return;
  out_.triangle_bend.assign(static_cast<size_t>(out_.triangle_count()), 0);
  for (const MeshRange& mesh : out_.meshes) {
    std::fill_n(out_.triangle_bend.begin() + mesh.first_triangle, mesh.triangle_count, mesh.bend);
  }
}

void GeometryBuilder::add_mesh(const ShapeDescription& s, const PlacedMesh& placed,
                               std::span<const FaceId> left_out) {
  const TriangleMesh& mesh = *placed.mesh;
  const auto first_vertex = static_cast<int32_t>(placed.first_vertex);
  const Matrix& m = s.object_to_world.m;
  int32_t flags = surface_flips_normal(s) ? RenderScene::kFlip : 0;
  if (keep_uvs_ && !mesh.uvs.empty()) flags |= RenderScene::kHasUv;
  if (is_of_fibres(s)) flags |= RenderScene::kFibre;
  if (is_hidden(s.hidden, kCameraRays)) flags |= RenderScene::kUnseen;
  if (has_alpha_mask(s.alpha)) flags |= RenderScene::kMasked;
  MeshRange range{out_.triangle_count(), 0, s.alpha};
  range.hidden = s.hidden;
  range.names = s.names;
  out_.hides |= s.hidden;
  const size_t steps = bends_here(s) ? mesh.later.size() + 1 : 1;
  size_t collapsed = 0, too_small = 0;
  for (const auto& t : mesh.triangles) {
    if (!left_out.empty() && left_out.front().triangle == &t - mesh.triangles.data()) {
      left_out = left_out.subspan(1);
      continue;
    }
    const int32_t i[3] = {first_vertex + static_cast<int32_t>(t[0]),
                          first_vertex + static_cast<int32_t>(t[1]),
                          first_vertex + static_cast<int32_t>(t[2])};
    const double area = largest_area(i, mesh.positions.size(), steps);
    // Collapsed when rounded to float: nothing can hit it.
    const bool unseen = !(area > 0) || !std::isfinite(area);
    collapsed += unseen;
    int32_t light = -1;
    if (s.area_light >= 0) {
      const TriangleArea exact = unrounded(m, mesh, t);
      const EmittingTriangle emitter{i, exact.normal, exact.area, flags, unseen || is_unseen_emitter(s)};
      if (!in_object() && emitters_.is_copy(s, emitter)) continue;
      const bool dark = emitter.area < kLeastLightArea;
      too_small += dark;
      if (!dark) light = emitters_.add_triangle(s, emitter);
      if (in_object() && light >= 0) {
        ObjectEmitter& e = object_emitters_.emplace_back(ObjectEmitter{light, {i[0], i[1], i[2]}, {}});
        if (steps > 1)
          e.bend = {static_cast<int32_t>(mesh.positions.size()), static_cast<int32_t>(steps) - 1};
      }
    }
    if (unseen || is_unseen_emitter(s)) continue;
    out_.surface_area += area;
    out_.indices.insert(out_.indices.end(), i, i + 3);
    add_primitive(s, light, flags);
    ++range.triangle_count;
  }
  if (too_small > 0) {
    warn(s, std::to_string(too_small) +
                " emitting triangles are so small that float can't hold their area; they do not shine");
  } else if (collapsed > 0 && collapsed == mesh.triangles.size()) {
    warn(s, std::string("the shape is smaller than the steps of float at its distance from the camera: ") +
                (s.area_light >= 0 ? "it shines, but is not seen itself" : "nothing is seen of it"));
  }
  if (range.triangle_count > 0) {
    if (flags & RenderScene::kFibre) range.fibres = outwards(range, s.reverse_orientation);
    if (steps > 1) {
      if (out_.bends.empty()) out_.bends.emplace_back();
      range.bend = static_cast<int32_t>(out_.bends.size());
      out_.bends.push_back({static_cast<int32_t>(mesh.positions.size()), static_cast<int32_t>(steps) - 1});
    }
    out_.meshes.push_back(range);
    out_.any_alpha = out_.any_alpha || has_alpha_mask(range.alpha);
    use_material(s);
  }
  surround_lights(media_.sides(s) & (kMediumTransition - 1));
}

bool GeometryBuilder::is_of_fibres(const ShapeDescription& s) const {
  const auto* shape = std::get_if<MeshShape>(&s.kind);
  if (shape == nullptr || !shape->mesh->tube || shape->mesh->normals.empty()) return false;
  return shape->mesh->flat || (s.material >= 0 && std::holds_alternative<HairMaterial>(
                                                      in_.materials[static_cast<size_t>(s.material)].kind));
}

/// MeshRange::fibres of a mesh that has been added.
int32_t GeometryBuilder::outwards(const MeshRange& range, bool reversed) const {
  double sum = 0;
  for (int32_t t = range.first_triangle; t < range.first_triangle + range.triangle_count && sum == 0; ++t) {
    const int32_t* i = &out_.indices[static_cast<size_t>(t) * 3];
    const auto p = rounded_corners(i);
    const Vec3d a{p[1].x - p[0].x, p[1].y - p[0].y, p[1].z - p[0].z},
        b{p[2].x - p[0].x, p[2].y - p[0].y, p[2].z - p[0].z};
    const float* n = &out_.normals[static_cast<size_t>(i[0]) * 3];
    sum = (a.y * b.z - a.z * b.y) * double{n[0]} + (a.z * b.x - a.x * b.z) * double{n[1]} +
          (a.x * b.y - a.y * b.x) * double{n[2]};
  }
  return (sum < 0) != reversed ? -1 : 1;
}

void GeometryBuilder::use_material(const ShapeDescription& s) {
  if (s.material >= 0 && !s.boundary) used_[static_cast<size_t>(s.material)] = true;
}

std::array<Vec3d, 3> GeometryBuilder::rounded_corners(const int32_t* i) const {
  std::array<Vec3d, 3> p;
  for (size_t k = 0; k < 3; ++k) {
    const float* v = &out_.positions[static_cast<size_t>(i[k]) * 3];
    p[k] = {double{v[0]}, double{v[1]}, double{v[2]}};
  }
  return p;
}

/// Emitters shine by the area that they have before rounding, however small: by their edges, as even double
/// rounds points.
GeometryBuilder::TriangleArea GeometryBuilder::unrounded(const Matrix& m, const TriangleMesh& mesh,
                                                         const std::array<uint32_t, 3>& t) const {
  const Vec3f& v0 = mesh.positions[t[0]];
  std::array<Vec3d, 3> p{};
  for (size_t k = 1; k < 3; ++k) {
    const Vec3f& v = mesh.positions[t[k]];
    const double e[3] = {double{v.x} - v0.x, double{v.y} - v0.y, double{v.z} - v0.z};
    const auto row = [&](size_t i) {
      return std::ldexp(m[i][0] * e[0] + m[i][1] * e[1] + m[i][2] * e[2], space_.exponent);
    };
    p[k] = {row(0), row(1), row(2)};
  }
  return triangle_area(p);
}

GeometryBuilder::TriangleArea GeometryBuilder::triangle_area(const std::array<Vec3d, 3>& p) {
  const double a[3] = {p[1].x - p[0].x, p[1].y - p[0].y, p[1].z - p[0].z};
  const double b[3] = {p[2].x - p[0].x, p[2].y - p[0].y, p[2].z - p[0].z};
  const double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
  const double length = std::sqrt(x * x + y * y + z * z);
  if (!(length > 0)) return {};
  return {0.5 * length, {x / length, y / length, z / length}};
}

PlacedSphere GeometryBuilder::placed_sphere(const ShapeDescription& s, const SphereShape& sphere) const {
  const double scale = *uniform_scale(s.object_to_world.m);
  const Vec3d c = space_.relative(transform_point(s.object_to_world.m, 0, 0, 0));
  const double radius = std::ldexp(scale * sphere.radius, space_.exponent);
  return {
      {static_cast<float>(c.x), static_cast<float>(c.y), static_cast<float>(c.z), static_cast<float>(radius)},
      kRoundoff * radius};
}

void GeometryBuilder::add_sphere(const ShapeDescription& s, const std::array<float, 4>& record) {
  const double scale = *uniform_scale(s.object_to_world.m);
  const double radius = record[3];
  out_.spheres.insert(out_.spheres.end(), record.begin(), record.end());
  const Matrix& m = s.object_to_world.m;
  for (size_t axis = 0; axis < 3; ++axis) {
    for (size_t row = 0; row < 3; ++row) out_.sphere_axes.push_back(static_cast<float>(m[row][axis] / scale));
  }
  const bool copy = s.area_light >= 0 && emitters_.is_copied_sphere(s);
  const int32_t light = s.area_light >= 0 && !copy ? emitters_.add_sphere(s) : -1;
  surround_lights(media_.sides(s) & (kMediumTransition - 1));
  if (copy || is_unseen_emitter(s)) {
    out_.spheres.resize(out_.spheres.size() - 4);
    out_.sphere_axes.resize(out_.sphere_axes.size() - 9);
    return;
  }
  out_.surface_area += 4 * M_PI * radius * radius;
  out_.sphere_names.push_back(s.names);
  // The normal is computed outwards, so handedness does not matter: only ReverseOrientation flips.
  out_.hides |= s.hidden;
  if (s.hidden != 0) out_.sphere_hidden.resize(static_cast<size_t>(out_.sphere_count()) - 1);
  if (s.hidden != 0 || !out_.sphere_hidden.empty()) out_.sphere_hidden.push_back(s.hidden);
  int32_t flags = s.reverse_orientation ? RenderScene::kFlip : 0;
  if (is_hidden(s.hidden, kCameraRays)) flags |= RenderScene::kUnseen;
  add_primitive(s, light, flags);
  use_material(s);
}

}  // namespace lightmill
