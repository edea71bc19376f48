// Normalises a scene description into flat arrays. Everything that rounds happens once, here, in double.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "common/error.h"
#include "common/scene/parts_in_use.h"
#include "common/scene/transform.h"
#include "worker/render/scene/alpha_mask.h"
#include "worker/render/scene/bump.h"
#include "worker/render/scene/emitter_builder.h"
#include "worker/render/scene/instancing.h"
#include "worker/render/scene/light_builder.h"
#include "worker/render/scene/material_builder.h"
#include "worker/render/scene/media_builder.h"
#include "worker/render/scene/render_scene.h"
#include "worker/render/scene/texture_check.h"

namespace lightmill {
namespace {

using Matrix = std::array<std::array<double, 4>, 4>;

Vec3d transform_point(const Matrix& m, double x, double y, double z) {
  const double w = m[3][0] * x + m[3][1] * y + m[3][2] * z + m[3][3];
  const double s = w == 1 ? 1 : 1 / w;
  return {(m[0][0] * x + m[0][1] * y + m[0][2] * z + m[0][3]) * s,
          (m[1][0] * x + m[1][1] * y + m[1][2] * z + m[1][3]) * s,
          (m[2][0] * x + m[2][1] * y + m[2][2] * z + m[2][3]) * s};
}

/// Normals transform by the inverse transpose: the cofactor matrix does it up to |det|, without a division.
Vec3d transform_normal(const Matrix& m, double x, double y, double z) {
  const auto c = [&](int i, int j) {
    const int a = (i + 1) % 3, b = (i + 2) % 3, p = (j + 1) % 3, q = (j + 2) % 3;
    const auto u = [](int k) { return static_cast<size_t>(k); };
    return m[u(a)][u(p)] * m[u(b)][u(q)] - m[u(a)][u(q)] * m[u(b)][u(p)];
  };
  const double det = m[0][0] * c(0, 0) + m[0][1] * c(0, 1) + m[0][2] * c(0, 2);
  const double s = det < 0 ? -1 : 1;
  return {s * (c(0, 0) * x + c(0, 1) * y + c(0, 2) * z), s * (c(1, 0) * x + c(1, 1) * y + c(1, 2) * z),
          s * (c(2, 0) * x + c(2, 1) * y + c(2, 2) * z)};
}

/// The uniform scale of a transform, or nothing if it is not a similarity (relative tolerance 1e-4).
std::optional<double> uniform_scale(const Matrix& m) {
  double length[3];
  for (size_t j = 0; j < 3; ++j) {
    length[j] = std::sqrt(m[0][j] * m[0][j] + m[1][j] * m[1][j] + m[2][j] * m[2][j]);
  }
  const double s = length[0];
  if (!(s > 0)) return std::nullopt;
  for (size_t j = 0; j < 3; ++j) {
    const size_t k = (j + 1) % 3;
    const double d = m[0][j] * m[0][k] + m[1][j] * m[1][k] + m[2][j] * m[2][k];
    if (std::fabs(length[j] / s - 1) > 1e-4 || std::fabs(d) > 1e-4 * s * s) return std::nullopt;
  }
  return s;
}

/// Of an emitter in normalised space: densities per area stay within float.
constexpr double kLeastLightArea = 1e-36;

struct Bounds {
  double lo[3] = {1e300, 1e300, 1e300}, hi[3] = {-1e300, -1e300, -1e300};
  void add(const Vec3d& p, double r = 0) {
    const double c[3] = {p.x, p.y, p.z};
    for (int i = 0; i < 3; ++i) {
      lo[i] = std::min(lo[i], c[i] - r);
      hi[i] = std::max(hi[i], c[i] + r);
    }
  }
  bool empty() const { return lo[0] > hi[0]; }
};

/// World-space (double) geometry before normalisation: only bounds are kept, points are computed twice.
class SceneBuilder {
 public:
  SceneBuilder(const SceneDescription& description, const PartsInUse& parts, RenderScene* scene)
      : in_(description),
        parts_(parts),
        out_(*scene),
        split_(split_instances(description)),
        emitters_(description, scene) {
    for (const ShapeDescription& s : in_.shapes) world_.push_back(&s);
    for (const ShapeDescription& s : split_.flattened) world_.push_back(&s);
    shapes_ = world_;
    for (const InstancedObject& o : split_.objects)
      shapes_.insert(shapes_.end(), o.shapes.begin(), o.shapes.end());
    media_.emplace(in_, shapes_);
    std::erase_if(world_, [&](const ShapeDescription* s) { return media_->is_nothing(*s); });
    std::erase_if(shapes_, [&](const ShapeDescription* s) { return media_->is_nothing(*s); });
    for (InstancedObject& o : split_.objects)
      std::erase_if(o.shapes, [&](const ShapeDescription* s) { return media_->is_nothing(*s); });
    emitters_.expect(shapes_);
  }

  void build() {
    const Matrix& c2w = in_.camera.camera_to_world.m;
    out_.origin = {c2w[0][3], c2w[1][3], c2w[2][3]};
    measure();
    media_->write(&out_);
    if (const int cycle = mix_in_a_cycle(in_.materials); cycle >= 0) {
      throw Error(ErrorKind::kBadScene, "the mix " + in_.materials[static_cast<size_t>(cycle)].name +
                                            " contains itself; take it out of what it mixes");
    }
    add_materials(in_.materials, &out_);
    reserve();
    space_ = {out_.origin, out_.scale_exponent};
    add_meshes(world_);
    add_object_meshes();
    add_spheres(world_);
    add_object_spheres();
    add_instances();
    emitters_.report();
    out_.positions.resize(out_.positions.size() + 4);  // vector loads read past the last vertex
    for (const LightDescription& l : in_.lights) {
      add_light(l, &out_);
      surround_lights(media_->around(l.medium));
    }
    out_.lights.finish();
    use_mixed_materials();
    for (size_t i = 0; i < out_.materials.size(); ++i) {
      if (!used_[i]) continue;
      const int32_t kind = out_.material_kind[i];
      out_.any_texture = out_.any_texture || out_.materials[i].textured;
      out_.any_bumps = out_.any_bumps || has_bumps(out_.materials[i]);
      out_.any_delta = out_.any_delta || has_delta(kind);
      out_.any_mix = out_.any_mix || kind == kMix;
      out_.any_anisotropy = out_.any_anisotropy || anisotropic<float>(kind);
      out_.any_fibres = out_.any_fibres || kind == kHair;
      kinds_ |= 1u << kind;
    }
    out_.any_texture = out_.any_texture || emitters_.any_texture();
    out_.only_diffuse = !(kinds_ & ~(1u << kDiffuse));
    for (; kinds_; kinds_ &= kinds_ - 1) ++out_.kinds_present;
    apply_overrides();
    out_.any_tangent = out_.any_tangent || out_.any_bumps || out_.any_anisotropy || out_.any_fibres;
  }

 private:
  /// Sets the flags of what is to be kept; each of them guards code that does nothing where nothing needs it.
  void apply_overrides() {
    const auto keep = [&](Features feature, bool* flag) { *flag = *flag || out_.overrides & feature; };
    keep(kTextures, &out_.any_texture);
    keep(kBumps, &out_.any_bumps);
    keep(kAnisotropicLobes, &out_.any_anisotropy);
    keep(kMixes, &out_.any_mix);
    keep(kAlphaMasks, &out_.any_alpha);
    keep(kDeltaLights, &out_.lights.any_delta);
    if (out_.overrides & kMaterialSort) out_.kinds_present = std::max(out_.kinds_present, 2);
  }

  /// What a mix in use contains is in use.
  void use_mixed_materials() {
    std::vector<size_t> todo;
    for (size_t i = 0; i < used_.size(); ++i) {
      if (used_[i]) todo.push_back(i);
    }
    while (!todo.empty()) {
      const MaterialEntry& e = out_.materials[todo.back()];
      todo.pop_back();
      for (const int child : {e.mix_first, e.mix_second}) {
        if (child < 0 || used_[static_cast<size_t>(child)]) continue;
        used_[static_cast<size_t>(child)] = true;
        todo.push_back(static_cast<size_t>(child));
      }
    }
  }

  /// Where geometry is kept: p -> (p - origin) 2^exponent.
  struct Space {
    Vec3d origin;
    int exponent = 0;
  };
  Vec3d relative(const Vec3d& p) const {
    return {std::ldexp(p.x - space_.origin.x, space_.exponent),
            std::ldexp(p.y - space_.origin.y, space_.exponent),
            std::ldexp(p.z - space_.origin.z, space_.exponent)};
  }

  void add_meshes(const std::vector<const ShapeDescription*>& shapes) {
    for (const ShapeDescription* s : shapes) {
      if (const auto* mesh = std::get_if<MeshShape>(&s->kind)) add_mesh(*s, *mesh->mesh);
    }
  }
  void add_spheres(const std::vector<const ShapeDescription*>& shapes) {
    for (const ShapeDescription* s : shapes) {
      if (const auto* sphere = std::get_if<SphereShape>(&s->kind)) add_sphere(*s, *sphere);
    }
  }

  /// Runs `add` in the space of each object in turn; what it adds to the surface area is the object's.
  template <class Add>
  void in_objects(const Add& add) {
    object_area_.resize(split_.objects.size());
    const Space world = space_;
    for (size_t i = 0; i < split_.objects.size(); ++i) {
      space_ = {split_.objects[i].center, split_.objects[i].exponent};
      const double before = out_.surface_area;
      add(split_.objects[i], out_.objects[i]);
      object_area_[i] += std::exchange(out_.surface_area, before) - before;
    }
    space_ = world;
  }
  void add_object_meshes() {
    out_.objects.resize(split_.objects.size());
    in_objects([&](const InstancedObject& from, ObjectRange& range) {
      range.first_mesh = out_.meshes.size();
      add_meshes(from.shapes);
      range.mesh_count = out_.meshes.size() - range.first_mesh;
    });
  }
  void add_object_spheres() {
    in_objects([&](const InstancedObject& from, ObjectRange& range) {
      range.first_sphere = out_.sphere_count();
      add_spheres(from.shapes);
      range.sphere_count = out_.sphere_count() - range.first_sphere;
      const Vec3d lo = relative({from.lo[0], from.lo[1], from.lo[2]}),
                  hi = relative({from.hi[0], from.hi[1], from.hi[2]});
      const double box[2][3] = {{lo.x, lo.y, lo.z}, {hi.x, hi.y, hi.z}};
      for (int i = 0; i < 3; ++i) {
        // Rounded as the vertices are; a sphere may round beyond its box.
        range.lo[i] = static_cast<float>(box[0][i]) - 0x1p-22f;
        range.hi[i] = static_cast<float>(box[1][i]) + 0x1p-22f;
      }
    });
  }
  void add_instances() {
    out_.flattened_instances = split_.flattened_instances;
    std::array<float, kInstanceFloats> record;
    for (const PlacedObject& i : split_.instances) {
      const InstancedObject& object = split_.objects[i.object];
      const Transform& t = *i.object_to_world;
      const Vec3d position =
          relative(transform_point(t.m, object.center.x, object.center.y, object.center.z));
      if (!instance_record(object, t, position, out_.scale_exponent, record.data()))
        continue;  // collapsed, as triangles of this size are
      out_.instance_records.insert(out_.instance_records.end(), record.begin(), record.end());
      out_.instance_object.push_back(static_cast<int32_t>(i.object));
      // Exact for a similarity, and near enough for what it is used for.
      const double scale = std::cbrt(std::fabs(determinant3(t)));
      out_.surface_area +=
          object_area_[i.object] * std::pow(std::ldexp(scale, out_.scale_exponent - object.exponent), 2);
    }
  }

  /// Lights that were added since the last call have `sides` around them.
  void surround_lights(int32_t sides) {
    if (media_->any()) out_.lights.media.resize(static_cast<size_t>(out_.lights.count()), sides);
  }

  static double sphere_scale(const ShapeDescription& s) {
    if (const auto scale = uniform_scale(s.object_to_world.m)) return *scale;
    throw Error(ErrorKind::kBadScene,
                place(s.location) + "a sphere under a non-uniform scale is not supported yet; use a mesh");
  }

  void measure() {
    Bounds b;
    for (const ShapeDescription* shape : shapes_) {
      const ShapeDescription& s = *shape;
      if (std::holds_alternative<SphereShape>(s.kind) && has_alpha_mask(s.alpha) && !is_unseen_emitter(s)) {
        throw Error(ErrorKind::kBadScene,
                    place(s.location) + "an alpha mask on a sphere is not supported; use a mesh");
      }
    }
    for (const ShapeDescription* shape : world_) {
      const ShapeDescription& s = *shape;
      if (const auto* mesh = std::get_if<MeshShape>(&s.kind)) {
        for (const Vec3f& v : mesh->mesh->positions)
          b.add(transform_point(s.object_to_world.m, v.x, v.y, v.z));
      } else {
        b.add(transform_point(s.object_to_world.m, 0, 0, 0),
              sphere_scale(s) * std::get<SphereShape>(s.kind).radius);
      }
    }
    for (const InstancedObject& o : split_.objects) {
      for (const ShapeDescription* s : o.shapes) {
        if (std::holds_alternative<SphereShape>(s->kind)) sphere_scale(*s);
      }
    }
    for (const PlacedObject& i : split_.instances) {
      const InstancedObject& o = split_.objects[i.object];
      for (int corner = 0; corner < 8; ++corner) {
        b.add(transform_point(i.object_to_world->m, corner & 1 ? o.hi[0] : o.lo[0],
                              corner & 2 ? o.hi[1] : o.lo[1], corner & 4 ? o.hi[2] : o.lo[2]));
      }
    }
    for (const LightDescription& l : in_.lights) {
      if (const auto* p = std::get_if<PointLight>(&l.kind)) b.add(p->position);
      if (const auto* p = std::get_if<SpotLight>(&l.kind)) b.add(p->position);
      const auto origin = [](const Transform& t) { return Vec3d{t.m[0][3], t.m[1][3], t.m[2][3]}; };
      if (const auto* p = std::get_if<GoniometricLight>(&l.kind)) b.add(origin(p->light_to_world));
      if (const auto* p = std::get_if<ProjectionLight>(&l.kind)) b.add(origin(p->light_to_world));
    }
    const Vec3d& o = out_.origin;
    // A medium that the camera stands in may have no boundary but the scene's.
    if (media_->any()) b.add(o);
    double extent = 0;
    if (!b.empty()) {
      const double from[3] = {o.x, o.y, o.z};
      for (int i = 0; i < 3; ++i)
        extent = std::max({extent, std::fabs(b.lo[i] - from[i]), std::fabs(b.hi[i] - from[i])});
    }
    if (!std::isfinite(extent))
      throw Error(ErrorKind::kBadScene, "the scene's extent is not finite; check its transforms");
    out_.scale_exponent = extent > 0 ? -std::ilogb(extent) : 0;
    if (b.empty()) return;
    const double s = std::ldexp(1.0, out_.scale_exponent);
    double r2 = 0;
    const double from[3] = {o.x, o.y, o.z};
    for (int i = 0; i < 3; ++i) {
      out_.bounds_center[i] = static_cast<float>((0.5 * (b.lo[i] + b.hi[i]) - from[i]) * s);
      const double half = 0.5 * (b.hi[i] - b.lo[i]) * s;
      r2 += half * half;
    }
    out_.bounds_radius = static_cast<float>(std::max(std::sqrt(r2) * 1.001, 1e-6));
  }

  void reserve() {
    size_t vertices = 0, triangles = 0, spheres = 0;
    bool normals = false, uvs = false, colors = false, read_uvs = false;
    for (const ShapeDescription* shape : shapes_) {
      const ShapeDescription& s = *shape;
      if (const auto* mesh = std::get_if<MeshShape>(&s.kind)) {
        vertices += mesh->mesh->positions.size();
        triangles += mesh->mesh->triangles.size();
        normals = normals || !mesh->mesh->normals.empty();
        uvs = uvs || !mesh->mesh->uvs.empty();
        out_.any_fibres = out_.any_fibres || is_of_fibres(s);
        read_uvs = read_uvs || is_of_fibres(s) || s.alpha.texture >= 0 ||
                   (s.area_light >= 0 && in_.area_lights[static_cast<size_t>(s.area_light)].texture >= 0);
        colors = colors || !mesh->mesh->colors.empty();
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
      read_uvs =
          read_uvs || (parts_.materials[i] && (m.textured || has_bumps(m) || anisotropic<float>(m.kind)));
    }
    keep_uvs_ = uvs && read_uvs;
    keep_uvs_ = keep_uvs_ || out_.overrides & kTextureCoordinates;
    if (keep_uvs_) out_.uvs.reserve(2 * vertices);
    bool read_colors = false;
    for (size_t i = 0; i < in_.textures.size(); ++i) {
      const bool reads = std::holds_alternative<VertexColorTexture>(in_.textures[i].kind);
      read_colors = read_colors || (reads && parts_.textures[i]);
    }
    out_.any_colors = colors && read_colors;
    out_.indices.reserve(3 * triangles);
    out_.primitive_material.reserve(triangles + spheres);
    out_.primitive_light.reserve(triangles + spheres);
    out_.primitive_flags.reserve(triangles + spheres);
    used_.assign(out_.materials.size(), false);
  }

  void warn(const ShapeDescription& s, std::string what) {
    out_.warnings.push_back({s.location, Severity::kWarning, std::move(what)});
  }

  void add_primitive(const ShapeDescription& s, int32_t light, int32_t flags) {
    out_.primitive_material.push_back(s.material);
    out_.primitive_light.push_back(light);
    out_.primitive_flags.push_back(flags);
    if (!media_->any()) return;
    out_.primitive_media.push_back(media_->sides(s));
    out_.any_boundaries = out_.any_boundaries || s.boundary;
  }

  void add_mesh(const ShapeDescription& s, const TriangleMesh& mesh) {
    const auto first_vertex = static_cast<int32_t>(out_.positions.size() / 3);
    const Matrix& m = s.object_to_world.m;
    for (const Vec3f& v : mesh.positions) {
      const Vec3d p = relative(transform_point(m, v.x, v.y, v.z));
      out_.positions.insert(out_.positions.end(),
                            {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
    }
    if (out_.any_normals) {
      const double sign = s.reverse_orientation ? -1 : 1;
      for (size_t i = 0; i < mesh.positions.size(); ++i) {
        Vec3d n;
        if (!mesh.normals.empty()) {
          n = transform_normal(m, mesh.normals[i].x, mesh.normals[i].y, mesh.normals[i].z);
          const double length = std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z);
          const double f = length > 0 && std::isfinite(length) ? sign / length : 0;
          n = {n.x * f, n.y * f, n.z * f};
        }
        out_.normals.insert(out_.normals.end(),
                            {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)});
      }
    }
    if (keep_uvs_) {
      for (size_t i = 0; i < mesh.positions.size(); ++i) {
        const Vec2f uv = mesh.uvs.empty() ? Vec2f{} : mesh.uvs[i];
        out_.uvs.insert(out_.uvs.end(), {uv.x, uv.y});
      }
    }
    if (out_.any_colors) {
      for (size_t i = 0; i < mesh.positions.size(); ++i) {
        const auto color = mesh.colors.empty() ? std::array<float, 4>{1, 1, 1, 1} : mesh.colors[i];
        out_.colors.insert(out_.colors.end(), color.begin(), color.end());
      }
    }
    int32_t flags = surface_flips_normal(s) ? RenderScene::kFlip : 0;
    if (keep_uvs_ && !mesh.uvs.empty()) flags |= RenderScene::kHasUv;
    if (is_of_fibres(s)) flags |= RenderScene::kFibre;
    MeshRange range{out_.triangle_count(), 0, s.alpha};
    size_t collapsed = 0, too_small = 0;
    for (const auto& t : mesh.triangles) {
      const int32_t i[3] = {first_vertex + static_cast<int32_t>(t[0]),
                            first_vertex + static_cast<int32_t>(t[1]),
                            first_vertex + static_cast<int32_t>(t[2])};
      const double area = triangle_area(rounded_corners(i)).area;
      // Collapsed when rounded to float: nothing can hit it.
      const bool unseen = !(area > 0) || !std::isfinite(area);
      collapsed += unseen;
      int32_t light = -1;
      if (s.area_light >= 0) {
        const Triangle exact = unrounded(m, mesh, t);
        const EmittingTriangle emitter{i, exact.normal, exact.area, flags, unseen || is_unseen_emitter(s)};
        if (emitters_.is_copy(s, emitter)) continue;
        const bool dark = emitter.area < kLeastLightArea;
        too_small += dark;
        if (!dark) light = emitters_.add_triangle(s, emitter);
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
      out_.meshes.push_back(range);
      out_.any_alpha = out_.any_alpha || has_alpha_mask(range.alpha);
      use_material(s);
    }
    surround_lights(media_->sides(s) & (kMediumTransition - 1));
  }

  bool is_of_fibres(const ShapeDescription& s) const {
    const auto* shape = std::get_if<MeshShape>(&s.kind);
    if (shape == nullptr || !shape->mesh->tube || shape->mesh->normals.empty()) return false;
    return shape->mesh->flat || (s.material >= 0 && std::holds_alternative<HairMaterial>(
                                                        in_.materials[static_cast<size_t>(s.material)].kind));
  }

  /// MeshRange::fibres of a mesh that has been added.
  int32_t outwards(const MeshRange& range, bool reversed) const {
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

  void use_material(const ShapeDescription& s) {
    if (s.material >= 0 && !s.boundary) used_[static_cast<size_t>(s.material)] = true;
  }

  std::array<Vec3d, 3> rounded_corners(const int32_t* i) const {
    std::array<Vec3d, 3> p;
    for (size_t k = 0; k < 3; ++k) {
      const float* v = &out_.positions[static_cast<size_t>(i[k]) * 3];
      p[k] = {double{v[0]}, double{v[1]}, double{v[2]}};
    }
    return p;
  }

  struct Triangle {
    double area = 0;
    Vec3d normal;  // unit, of the winding
  };
  /// Emitters shine by the area that they have before rounding, however small: by their edges, as even double
  /// rounds points.
  Triangle unrounded(const Matrix& m, const TriangleMesh& mesh, const std::array<uint32_t, 3>& t) const {
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

  static Triangle triangle_area(const std::array<Vec3d, 3>& p) {
    const double a[3] = {p[1].x - p[0].x, p[1].y - p[0].y, p[1].z - p[0].z};
    const double b[3] = {p[2].x - p[0].x, p[2].y - p[0].y, p[2].z - p[0].z};
    const double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
    const double length = std::sqrt(x * x + y * y + z * z);
    if (!(length > 0)) return {};
    return {0.5 * length, {x / length, y / length, z / length}};
  }

  void add_sphere(const ShapeDescription& s, const SphereShape& sphere) {
    const double scale = *uniform_scale(s.object_to_world.m);
    const Vec3d c = relative(transform_point(s.object_to_world.m, 0, 0, 0));
    const double radius = std::ldexp(scale * sphere.radius, space_.exponent);
    if (!(static_cast<float>(radius) > 0)) return;
    const float record[4] = {static_cast<float>(c.x), static_cast<float>(c.y), static_cast<float>(c.z),
                             static_cast<float>(radius)};
    out_.spheres.insert(out_.spheres.end(), record, record + 4);
    const Matrix& m = s.object_to_world.m;
    for (size_t axis = 0; axis < 3; ++axis) {
      for (size_t row = 0; row < 3; ++row)
        out_.sphere_axes.push_back(static_cast<float>(m[row][axis] / scale));
    }
    const bool copy = s.area_light >= 0 && emitters_.is_copied_sphere(s);
    const int32_t light = s.area_light >= 0 && !copy ? emitters_.add_sphere(s) : -1;
    surround_lights(media_->sides(s) & (kMediumTransition - 1));
    if (copy || is_unseen_emitter(s)) {
      out_.spheres.resize(out_.spheres.size() - 4);
      out_.sphere_axes.resize(out_.sphere_axes.size() - 9);
      return;
    }
    out_.surface_area += 4 * M_PI * radius * radius;
    // The normal is computed outwards, so handedness does not matter: only ReverseOrientation flips.
    const int32_t flags = s.reverse_orientation ? RenderScene::kFlip : 0;
    add_primitive(s, light, flags);
    use_material(s);
  }

  const SceneDescription& in_;
  const PartsInUse& parts_;
  RenderScene& out_;
  SplitScene split_;
  std::vector<const ShapeDescription*> world_, shapes_;  // in normalised space; and those of objects, too
  Space space_;
  std::vector<double> object_area_;  // in the object's space
  std::vector<bool> used_;
  unsigned kinds_ = 0;
  bool keep_uvs_ = false;
  EmitterBuilder emitters_;
  std::optional<MediaBuilder> media_;
};

}  // namespace

RenderScene build_scene(const SceneDescription& description, bool energy_compensation, Features overrides,
                        const BuildOptions& options) {
  const PartsInUse parts = parts_in_use(description);
  RenderScene scene(TextureTable(description.textures, options,
                                 options.unused_textures ? std::vector<bool>() : parts.textures));
  scene.warnings = check_textures(description, scene.textures);
  scene.energy_compensation = energy_compensation;
  scene.overrides = overrides;
  SceneBuilder(description, parts, &scene).build();
  return scene;
}

uint64_t bytes_of(const RenderScene& s) {
  const auto bytes = [](const auto&... arrays) {
    return (uint64_t{0} + ... + (arrays.capacity() * sizeof arrays[0]));
  };
  uint64_t lights = bytes(s.lights.records, s.lights.type, s.lights.alias_keep, s.lights.alias);
  const auto add_map = [&](const auto& map) {
    lights += bytes(map.rgb, map.density, map.alias_keep, map.alias);
  };
  std::for_each(s.lights.environments.begin(), s.lights.environments.end(), add_map);
  std::for_each(s.lights.goniometers.begin(), s.lights.goniometers.end(), add_map);
  std::for_each(s.lights.projectors.begin(), s.lights.projectors.end(), add_map);
  return lights + s.textures.bytes() +
         bytes(s.positions, s.normals, s.colors, s.uvs, s.indices, s.meshes, s.spheres, s.sphere_axes,
               s.instance_records, s.instance_object, s.primitive_material, s.primitive_light,
               s.primitive_flags, s.bsdf_tables);
}

}  // namespace lightmill
