// Normalises a scene description into flat arrays.
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "common/base/error.h"
#include "common/scene/lights/scene_light_groups.h"
#include "common/scene/parts_in_use.h"
#include "common/scene/transform.h"
#include "worker/render/scene/geometry/alpha_mask.h"
#include "worker/render/scene/geometry/displacement.h"
#include "worker/render/scene/geometry/geometry_builder.h"
#include "worker/render/scene/geometry/instancing.h"
#include "worker/render/scene/lights/emitter_builder.h"
#include "worker/render/scene/lights/emitter_steps.h"
#include "worker/render/scene/lights/normalised_light.h"
#include "worker/render/scene/lights/volume_lights.h"
#include "worker/render/scene/materials/bump.h"
#include "worker/render/scene/materials/material_builder.h"
#include "worker/render/scene/media/media_builder.h"
#include "worker/render/scene/render_scene.h"
#include "worker/render/scene/scene_extent.h"
#include "worker/render/scene/shutter.h"
#include "worker/render/scene/textures/graph/constant_graphs.h"
#include "worker/render/scene/textures/texture_check.h"

namespace lightmill {
namespace {

/// Media without boundary reach this many times as far as the scene where no light comes from infinity: what
/// scatters beyond sends less than a thousandth of its light back.
constexpr float kEndlessReach = 1024;

/// Grids may take what textures leave, but this much.
constexpr uint64_t kLeastGridBytes = uint64_t{16} << 20;

std::shared_ptr<SpillArea> grid_memory(const BuildOptions& options, uint64_t texture_bytes) {
  const uint64_t all = options.texture_bytes;
  if (all == kUnboundedTextures) return nullptr;
  const uint64_t left = all > texture_bytes ? all - texture_bytes : 0;
  return std::make_shared<SpillArea>(std::max(left, kLeastGridBytes), options.spill_folder);
}

class SceneBuilder {
 public:
  SceneBuilder(const SceneDescription& description, const PartsInUse& parts, const BuildOptions& options,
               RenderScene* scene)
      : in_(description),
        parts_(parts),
        out_(*scene),
        split_(split_instances(description)),
        threads_(options.threads),
        normalised_light_(options.normalised_light),
        emitters_(description, scene) {
    for (const ShapeDescription& s : in_.shapes) {
      if (!changes(s)) world_.push_back(&s);
    }
    for (const ShapeDescription& s : split_.flattened) world_.push_back(&s);
    shapes_ = world_;
    for (const InstancedObject& o : split_.objects)
      shapes_.insert(shapes_.end(), o.shapes.begin(), o.shapes.end());
    media_.emplace(in_, shapes_, grid_memory(options, out_.textures.bytes()), &out_.warnings);
    std::erase_if(world_, [&](const ShapeDescription* s) { return media_->is_nothing(*s); });
    std::erase_if(shapes_, [&](const ShapeDescription* s) { return media_->is_nothing(*s); });
    for (InstancedObject& o : split_.objects)
      std::erase_if(o.shapes, [&](const ShapeDescription* s) { return media_->is_nothing(*s); });
    emitters_.expect(shapes_);
    geometry_.emplace(in_, *media_, emitters_, &out_);
  }

  void build() {
    const Matrix& c2w = in_.camera.camera_to_world.m;
    out_.origin = {c2w[0][3], c2w[1][3], c2w[2][3]};
    measure();
    name_mattes();
    size_t groups_left_out = 0;
    out_.light_groups = light_groups_of(in_, &groups_left_out);
    if (groups_left_out > 0) {
      out_.warnings.push_back({{},
                               Severity::kWarning,
                               "the scene has more than " + std::to_string(kMaxLightGroups - 1) +
                                   " light groups: " + std::to_string(groups_left_out) +
                                   " are left to the group \"rest\""});
    }
    media_->write(threads_, &out_);
    if (const int cycle = mix_in_a_cycle(in_.materials); cycle >= 0) {
      throw Error(ErrorKind::kBadScene, "the mix " + in_.materials[static_cast<size_t>(cycle)].name +
                                            " contains itself; take it out of what it mixes");
    }
    add_materials(in_.materials, &out_);
    geometry_->reserve(shapes_, parts_);
    geometry_->set_space({out_.origin, out_.scale_exponent}, {.threads = threads_});
    geometry_->add_meshes(world_);
    add_object_meshes();
    geometry_->add_spheres(world_);
    add_object_spheres();
    add_instances();
    geometry_->finish_bends();
    move_emitters();
    set_times();
    emitters_.report();
    geometry_->report();
    out_.positions.resize(out_.positions.size() + 4);  // vector loads read past the last vertex
    for (const LightDescription& l : in_.lights) {
      add_light(l, &out_);
      geometry_->surround_lights(media_->around(l.medium));
    }
    add_volume_lights(threads_, &out_);
    if (!out_.any_media()) out_.lights.meet_lamps();
    out_.lights.finish();
    warn_if_dark();
    out_.media_reach = out_.bounds_radius * (out_.lights.any_infinite() ? 1 : kEndlessReach);
    const std::vector<bool> used = materials_in_use();
    bool by_pixel = false;
    for (size_t i = 0; i < out_.materials.size(); ++i) {
      if (!used[i]) continue;
      const int32_t kind = out_.material_kind[i];
      out_.any_texture = out_.any_texture || out_.materials[i].textured;
      out_.any_bumps = out_.any_bumps || has_bumps(out_.materials[i]);
      by_pixel = by_pixel || faces_viewer(out_.materials[i]);
      out_.any_delta = out_.any_delta || has_delta(kind);
      out_.any_mix = out_.any_mix || kind == kMix;
      out_.any_weighted_mix =
          out_.any_weighted_mix || (kind == kMix && out_.materials[i].mix_rule != MixRule::kChance);
      out_.any_anisotropy = out_.any_anisotropy || anisotropic<float>(kind);
      out_.any_fibres = out_.any_fibres || kind == kHair;
      out_.any_bodies = out_.any_bodies || enters_bodies<float>(kind);
      kinds_ |= uint64_t{1} << kind;
      // A mix is what it chooses, which is in use too.
      if (!is_pure_delta(kind) && kind != kMix) joined_kinds_ |= uint64_t{1} << kind;
    }
    if (by_pixel)
      out_.pixel_camera.emplace(
          make_camera(in_.camera, in_.film.width, in_.film.height, out_.scale_exponent));
    out_.any_texture = out_.any_texture || emitters_.any_texture();
    out_.only_diffuse = !(kinds_ & ~(uint64_t{1} << kDiffuse));
    out_.only_diffuse_joined = !(joined_kinds_ & ~(uint64_t{1} << kDiffuse));
    for (; kinds_; kinds_ &= kinds_ - 1) ++out_.kinds_present;
    apply_overrides();
    out_.any_tangent = out_.any_tangent || out_.any_bumps || out_.any_anisotropy || out_.any_fibres;
  }

 private:
  void name_mattes() {
    out_.mattes = MatteTable(in_);
    if (out_.mattes.left_out() == 0) return;
    out_.warnings.push_back({{},
                             Severity::kWarning,
                             "the scene has more names than Cryptomatte can tell apart: " +
                                 std::to_string(out_.mattes.left_out()) + " of them are \"" + kOtherMatte +
                                 "\" there"});
  }
  /// The readers see to it that a scene has lights; what they shine by may still be black.
  void warn_if_dark() {
    const auto glows = [](const MediumDescription& m) { return !is_black(brightest(m)); };
    if (out_.lights.count() > 0 || in_.strict_lights || std::ranges::any_of(in_.media, glows)) return;
    if (in_.lights.empty() && in_.area_lights.empty()) return;  // made so, by a program
    SourceLocation start;
    if (!in_.files.empty()) start.file = in_.files.front().name;
    start.line = start.column = 1;
    out_.warnings.push_back(
        {start, Severity::kWarning, "no light of the scene shines: the picture will be black"});
  }
  /// Sets the flags of what is to be kept; each of them guards code that does nothing where nothing needs it.
  void apply_overrides() {
    const auto keep = [&](Features feature, bool* flag) { *flag = *flag || out_.overrides & feature; };
    keep(kTextures, &out_.any_texture);
    keep(kTextureCoordinates, &out_.records_uvs);
    keep(kBumps, &out_.any_bumps);
    keep(kAnisotropicLobes, &out_.any_anisotropy);
    keep(kMixes, &out_.any_mix);
    keep(kAlphaMasks, &out_.any_alpha);
    keep(kDeltaLights, &out_.lights.any_delta);
    if (out_.overrides & kMaterialSort) out_.kinds_present = std::max(out_.kinds_present, 2);
  }

  /// Those of primitives, and what a mix in use contains.
  std::vector<bool> materials_in_use() const {
    std::vector<bool> used = geometry_->materials_in_use();
    std::vector<size_t> todo;
    for (size_t i = 0; i < used.size(); ++i) {
      if (used[i]) todo.push_back(i);
    }
    while (!todo.empty()) {
      const MaterialEntry& e = out_.materials[todo.back()];
      todo.pop_back();
      for (const int child : {e.mix_first, e.mix_second}) {
        if (child < 0 || used[static_cast<size_t>(child)]) continue;
        used[static_cast<size_t>(child)] = true;
        todo.push_back(static_cast<size_t>(child));
      }
    }
    return used;
  }

  /// Runs `add` in the space of each object in turn; what it adds to the surface area is the object's.
  template <class Add>
  void in_objects(const Add& add) {
    object_area_.resize(split_.objects.size());
    object_moved_.resize(split_.objects.size());
    const ShapeSpace world = geometry_->space();
    for (size_t i = 0; i < split_.objects.size(); ++i) {
      geometry_->set_space({split_.objects[i].center, split_.objects[i].exponent}, coincidence_in(i));
      const double before = out_.surface_area;
      add(split_.objects[i], out_.objects[i]);
      object_area_[i] += std::exchange(out_.surface_area, before) - before;
      object_moved_[i] = std::max(object_moved_[i], geometry_->moved());
    }
    geometry_->set_space(world, {.threads = threads_});
  }
  CoincidenceSpace coincidence_in(size_t object) {
    if (object_rounding_.empty()) object_rounding_ = rounding_of_instances(split_, out_.origin);
    return {false, kSetApartOverError * object_rounding_[object], threads_};
  }
  void add_object_meshes() {
    out_.objects.resize(split_.objects.size());
    in_objects([&](const InstancedObject& from, ObjectRange& range) {
      range.first_mesh = out_.meshes.size();
      first_emitter_.push_back(geometry_->object_emitters().size());
      geometry_->add_meshes(from.shapes);
      range.mesh_count = out_.meshes.size() - range.first_mesh;
    });
  }
  void add_object_spheres() {
    in_objects([&](const InstancedObject& from, ObjectRange& range) {
      range.first_sphere = out_.sphere_count();
      geometry_->add_spheres(from.shapes);
      range.sphere_count = out_.sphere_count() - range.first_sphere;
      const ShapeSpace& space = geometry_->space();
      const Vec3d lo = space.relative({from.lo[0], from.lo[1], from.lo[2]}),
                  hi = space.relative({from.hi[0], from.hi[1], from.hi[2]});
      const auto moved = static_cast<float>(
          1.001 *
          std::max(object_moved_[static_cast<size_t>(&range - out_.objects.data())], geometry_->moved()));
      const double box[2][3] = {{lo.x, lo.y, lo.z}, {hi.x, hi.y, hi.z}};
      for (int i = 0; i < 3; ++i) {
        // Rounded as the vertices are; a sphere may round beyond its box.
        range.lo[i] = static_cast<float>(box[0][i]) - 0x1p-22f - moved;
        range.hi[i] = static_cast<float>(box[1][i]) + 0x1p-22f + moved;
      }
    });
  }
  void add_instances() {
    out_.flattened_instances = split_.flattened_instances;
    std::array<float, kInstanceFloats> record;
    for (const PlacedObject& i : split_.instances) {
      const InstancedObject& object = split_.objects[i.object];
      const Transform& t = *i.object_to_world;
      const auto write = [&](const Transform& at, int exponent) {
        const Vec3d position = geometry_->space().relative(
            transform_point(at.m, object.center.x, object.center.y, object.center.z));
        return instance_record(object, at, exponent, position, out_.scale_exponent, record.data());
      };
      if (i.way >= 0) {
        // All of a way have one scale.
        int exponent = record_exponent(t);
        const std::vector<Transform>& way = split_.ways[static_cast<size_t>(i.way)];
        for (const Transform& at : way) exponent = std::min(exponent, record_exponent(at));
        const auto first_pose = static_cast<int32_t>(out_.poses.size() / kPoseFloats);
        bool some = true;
        for (const Transform& at : way) {
          some = some && write(at, exponent);
          out_.poses.insert(out_.poses.end(), record.begin(), record.begin() + kPoseFloats);
        }
        if (!some || !write(t, exponent)) {
          out_.poses.resize(static_cast<size_t>(first_pose) * kPoseFloats);
          continue;
        }
        out_.ways.push_back({first_pose, static_cast<int32_t>(way.size()) - 1});
      } else if (!write(t, record_exponent(t))) {
        continue;  // collapsed, as triangles of this size are
      }
      out_.instance_records.insert(out_.instance_records.end(), record.begin(), record.end());
      out_.instance_object.push_back(static_cast<int32_t>(i.object));
      out_.hides |= i.hidden;
      if (i.hidden != 0) out_.instance_hidden.resize(out_.instance_object.size() - 1);
      if (i.hidden != 0 || !out_.instance_hidden.empty()) out_.instance_hidden.push_back(i.hidden);
      const bool named = i.names != PartNames();
      if (named) out_.instance_names.resize(out_.instance_object.size() - 1);
      if (named || !out_.instance_names.empty()) out_.instance_names.push_back(i.names);
      // Exact for a similarity, and near enough for what it is used for.
      const double scale = std::cbrt(std::fabs(determinant3(t)));
      out_.surface_area +=
          object_area_[i.object] * std::pow(std::ldexp(scale, out_.scale_exponent - object.exponent), 2);
    }
    out_.first_moving = out_.instance_count() - static_cast<int32_t>(out_.ways.size());
    for (const ShapeDescription* s : split_.stopped) {
      out_.warnings.push_back({s->location, Severity::kWarning,
                               "what moves here is nearly flat on its way: it stays as at its start time"});
    }
  }

  /// Takes the lights of objects to where their one instance has them.
  void move_emitters() {
    const std::vector<ObjectEmitter>& emitters = geometry_->object_emitters();
    first_emitter_.push_back(emitters.size());
    std::vector<bool> placed(split_.objects.size(), false);
    for (int32_t i = 0; i < out_.instance_count(); ++i) {
      const auto object = static_cast<size_t>(out_.instance_object[static_cast<size_t>(i)]);
      placed[object] = true;
      for (size_t e = first_emitter_[object]; e < first_emitter_[object + 1]; ++e)
        out_.lights.set_moving(emitters[e].light, emitter_steps(out_, emitters[e], i));
    }
    for (size_t object = 0; object < placed.size(); ++object) {
      if (placed[object]) continue;
      for (size_t e = first_emitter_[object]; e < first_emitter_[object + 1]; ++e)
        out_.lights.darken(emitters[e].light);
    }
  }

  void set_times() {
    out_.camera_motion = camera_motion_of(in_, out_.scale_exponent);
    const ShutterDescription& shutter = in_.shutter;
    out_.moves_from = static_cast<float>(shutter.moves_from);
    out_.moves_rate = static_cast<float>(1 / (shutter.moves_until - shutter.moves_from));
    out_.shutter_times = shutter_times(shutter.openness, RenderScene::kShutterSteps);
  }

  /// Scale and bounds. Points are computed twice: a second copy of all would not fit beside large scenes.
  void measure() {
    for (const ShapeDescription* shape : shapes_) {
      const ShapeDescription& s = *shape;
      if (std::holds_alternative<SphereShape>(s.kind) && has_alpha_mask(s.alpha) && !is_unseen_emitter(s)) {
        throw Error(ErrorKind::kBadScene,
                    place(s.location) + "an alpha mask on a sphere is not supported; use a mesh");
      }
    }
    // A medium that the camera stands in may have no boundary but the scene's, or its grid's.
    std::vector<Vec3d> also;
    if (media_->any()) {
      also = media_->grid_corners();
      also.push_back(out_.origin);
      if (in_.camera.moves_to >= 0) {
        const Matrix& end = in_.later[static_cast<size_t>(in_.camera.moves_to)].m;
        also.push_back({end[0][3], end[1][3], end[2][3]});
      }
    }
    const SceneExtent extent = measure_extent(world_, split_, in_.lights, out_.origin, also);
    out_.scale_exponent = extent.scale_exponent;
    if (normalised_light_) out_.light_exponent = light_exponent(in_, extent.scale_exponent);
    if (extent.empty) return;
    std::copy_n(extent.center, 3, out_.bounds_center);
    out_.bounds_radius = extent.radius;
  }

  const SceneDescription& in_;
  const PartsInUse& parts_;
  RenderScene& out_;
  SplitScene split_;
  std::vector<const ShapeDescription*> world_, shapes_;  // in normalised space; and those of objects, too
  std::vector<double> object_area_, object_moved_, object_rounding_;  // in the object's space
  std::vector<size_t> first_emitter_;                                 // of each object, and their number
  int threads_;
  bool normalised_light_;
  uint64_t kinds_ = 0, joined_kinds_ = 0;
  EmitterBuilder emitters_;
  std::optional<MediaBuilder> media_;
  std::optional<GeometryBuilder> geometry_;
};

}  // namespace

RenderScene build_scene(const SceneDescription& description, bool energy_compensation, Features overrides,
                        const BuildOptions& options) {
  if (const auto simpler = with_constant_graphs(description))
    return build_scene(*simpler, energy_compensation, overrides, options);
  const PartsInUse parts = parts_in_use(description);
  RenderScene scene(TextureTable(description.textures, options,
                                 options.unused_textures ? std::vector<bool>() : parts.textures));
  scene.warnings = check_textures(description, scene.textures);
  scene.energy_compensation = energy_compensation;
  scene.overrides = overrides;
  const auto displaced = with_displaced_meshes(description, scene.textures, options.threads, &scene.warnings);
  SceneBuilder(displaced ? *displaced : description, parts, options, &scene).build();
  return scene;
}

MatteKey RenderScene::matte_key_of(int32_t prim, int32_t instance) const {
  const PartNames of_instance =
      instance < 0 || instance_names.empty() ? PartNames() : instance_names[static_cast<size_t>(instance)];
  const int material = primitive_material[static_cast<size_t>(prim)];
  if (prim >= triangle_count())
    return mattes.key(sphere_names[static_cast<size_t>(prim - triangle_count())], of_instance, material);
  const auto after = std::upper_bound(meshes.begin(), meshes.end(), prim,
                                      [](int32_t p, const MeshRange& m) { return p < m.first_triangle; });
  return mattes.key(std::prev(after)->names, of_instance, material);
}

uint64_t bytes_of(const RenderScene& s) {
  const auto bytes = [](const auto&... arrays) {
    return (uint64_t{0} + ... + (arrays.capacity() * sizeof arrays[0]));
  };
  uint64_t lights = s.caustics.bytes() + s.manifolds.bytes();
  const auto add_table = [&](const LightTable& l) {
    lights += bytes(l.records, l.type, l.alias_keep, l.alias, l.direct_keep, l.direct_alias) +
              l.guide.bytes() + l.emission_guide.bytes() + sizeof(int32_t) * l.emission_guide_of.capacity();
  };
  add_table(s.lights);
  if (s.guided_lights) add_table(*s.guided_lights);
  const auto add_map = [&](const auto& map) {
    lights += bytes(map.rgb, map.density, map.alias_keep, map.alias);
  };
  std::for_each(s.lights.environments.begin(), s.lights.environments.end(), add_map);
  for (const EnvironmentMap& map : s.lights.environments) lights += map.bins.bytes();
  for (const BinnedDensity& cells : s.lights.emission_cells) lights += cells.bytes();
  std::for_each(s.lights.goniometers.begin(), s.lights.goniometers.end(), add_map);
  std::for_each(s.lights.projectors.begin(), s.lights.projectors.end(), add_map);
  return lights + s.textures.bytes() +
         bytes(s.positions, s.normals, s.colors, s.uvs, s.second_uvs, s.indices, s.meshes, s.spheres,
               s.sphere_axes, s.sphere_names, s.instance_names, s.instance_records, s.instance_object,
               s.poses, s.ways, s.triangle_bend, s.primitive_material, s.primitive_light, s.primitive_flags,
               s.bsdf_tables, s.volumes.bricks, s.volumes.majorants, s.volumes.drawn, s.volumes.poses) +
         s.volumes.values.memory_bytes();
}

}  // namespace lightmill
