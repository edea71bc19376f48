#pragma once
// The scene as the kernels read it: flat arrays in normalised space.
//
// Normalised space has the camera at the origin. Lengths are scaled by 2^scale_exponent (exact), so that the
// scene's extent is about 1. Point intensities are scaled by its square. Radiance does not change, nor does
// the image. Primitives are numbered: triangles first, then spheres.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/job/features.h"
#include "common/job/light_groups.h"
#include "common/scene/description.h"
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/camera/camera.h"
#include "worker/render/camera/camera_motion.h"
#include "worker/render/guiding/manifold_seeds.h"
#include "worker/render/guiding/photon_guide.h"
#include "worker/render/light/light_table.h"
#include "worker/render/scene/cryptomatte/matte_table.h"
#include "worker/render/scene/media/medium.h"
#include "worker/render/scene/media/volume_table.h"
#include "worker/render/scene/textures/texture.h"

namespace lightmill {

struct MeshRange {
  int32_t first_triangle = 0, triangle_count = 0;
  FloatInput alpha{1, -1};  // see alpha_mask.h
  /// For fibres, whose backs let rays pass: 1 if cross(p1 - p0, p2 - p0) points outwards, -1 if inwards. Else
  /// 0.
  int32_t fibres = 0;
  int32_t bend = 0;  // index into RenderScene::bends
  RayKinds hidden = 0;
  PartNames names = {};
};
/// A mesh that bends while the shutter is open. Its vertices are there segments + 1 times, one block of them
/// after the other, at even times; between two they go straight.
struct MeshBend {
  int32_t vertices = 0;  // of a block
  int32_t segments = 1;  // a power of two, kMostSegments at most
};

/// A material: constant inputs in place, and textures for the others.
struct MaterialEntry {
  int32_t kind = kDiffuse;
  int32_t textured = 0;    // any of the textures below is set
  int texture_color = -1;  // reflectance: slots 0-2 (diffuse, coated) or, via F0, 0-5 (conductor)
  int texture_eta = -1, texture_k = -1;
  int texture_transmittance = -1;
  int texture_u_roughness = -1, texture_v_roughness = -1;
  int normal_map = -1, displacement = -1, shading_normal = -1, tangent = -1;  // as in MaterialDescription
  bool bump_by_pixel = false;                                                 // the same
  FloatInput bump_strength{1, -1};                                            // the same
  FloatInput opacity{1, -1};                                                  // the same
  Rgb tint{1, 1, 1};                                                          // the same
  float normal_scale = 1;
  bool normal_follows_v = false;
  int gltf = -1;             // metallic roughness and tinted: index into RenderScene::metallic or tinted
  Rgb color, transmittance;  // diffuse transmission, where not textured
  float scale = 1;           // of both
  float u_roughness = 0, v_roughness = 0;
  bool remap_roughness = true;
  int coat_base_encounters = 1;
  int mix_first = -1, mix_second = -1;  // mix: materials; `scale` is the second's share, or texture_color
  MixRule mix_rule = MixRule::kChance;
  FloatInput mix_metallic{0, -1};  // kTransmission, kBody
  bool mix_coated = false;         // the same
  // Blender's materials: index into RenderScene::principled or closures, and which of them.
  int blender = -1;
  bool principled = false;
  bool passed = false;            // a Transparent BSDF: what stops at the surface is another part of its mix
  float brightness = 1;           // about what it scatters, for choices
  bool hair_reflectance = false;  // hair: the colour is a reflectance; `scale` says how it is taken
  bool conductor_reflectance = false;  // color gives F0 by eta = 1, k = 2 sqrt(r / (1 - r))
  Rgb eta, k;                          // coated conductor: of the metal against air, where not textured
  float coat_eta = 1, coat_alpha = 0;
  int first_row = -1;        // textured roughness: in bsdf_tables, where the tables over alpha begin
  int floats_per_alpha = 0;  // and the size of one
  std::vector<std::array<double, 3>> coat_returned;  // coated diffuse: what goes back to the base, per alpha
};

/// Slots of an instance's record (placement.h): A over its scale by rows, the position of its object's
/// origin, W times that scale by rows, 1 / scale (a power of two), max row sum of |A||W|, sign of det A.
enum InstanceSlot {
  kInstanceA = 0,
  kInstancePosition = 9,
  kInstanceW = 12,
  kInstanceTimeScale = 21,
  kInstanceSpread = 22,
  kInstanceHandedness = 23
};
inline constexpr int kInstanceFloats = 24;
/// A pose is the first slots of a record: A and the position.
inline constexpr int kPoseFloats = kInstanceW;

/// The way of a moving instance: segments + 1 poses at even times, from `first_pose` on.
struct InstanceWay {
  int32_t first_pose = 0, segments = 1;  // a power of two, kMostSegments at most
};
inline constexpr int32_t kMostSegments = 128;  // the library's limit of time steps is 129

/// Meshes and spheres that are built once and placed by instances.
struct ObjectRange {
  size_t first_mesh = 0, mesh_count = 0;
  int32_t first_sphere = 0, sphere_count = 0;
  float lo[3] = {}, hi[3] = {};  // box in the object's space
};

struct RenderScene {
  explicit RenderScene(TextureTable table) : textures(std::move(table)) {}

  int scale_exponent = 0;
  int light_exponent = 0;  // all light is divided by 2^this (lights/normalised_light.h)
  Vec3d origin;            // camera position in scene units
  /// The camera, if some bump asks how wide a pixel is (bump.h).
  std::optional<Camera> pixel_camera;

  std::vector<float> positions;   // 3 per vertex, padded by 4 floats for vector loads
  std::vector<float> normals;     // 3 per vertex or empty; (0,0,0) where the mesh has none
  std::vector<float> colors;      // 4 per vertex or empty; 1 where the mesh has none
  std::vector<float> uvs;         // 2 per vertex or empty
  std::vector<float> second_uvs;  // the same
  std::vector<int32_t> indices;   // 3 per triangle
  std::vector<MeshRange> meshes;  // those of objects last
  std::vector<float> spheres;     // 4 per sphere: centre, radius
  /// 9 per sphere: the unit axes x, y, z of its object space, for its texture coordinates.
  std::vector<float> sphere_axes;
  std::vector<RayKinds> sphere_hidden;  // per sphere; empty if none is

  // Instanced objects. Their primitives follow those of the world, triangles and spheres alike. Their
  // positions and normals are in the object's space.
  std::vector<ObjectRange> objects;
  std::vector<float> instance_records;    // kInstanceFloats per instance
  std::vector<int32_t> instance_object;   // per instance
  std::vector<RayKinds> instance_hidden;  // per instance; empty if none is
  size_t flattened_instances = 0;         // built as shapes of their own

  // What moves while the shutter is open: instances from `first_moving` on, and the camera. If anything does,
  // a path has a time in [0, 1]. Records are those at time 0.
  int32_t first_moving = 0;
  std::vector<InstanceWay> ways;  // per moving instance
  std::vector<float> poses;       // kPoseFloats each
  // Meshes that bend are in objects, whose instances count as moving. If there are some: the first of `bends`
  // is that of meshes that do not, and each triangle has an index into them.
  std::vector<MeshBend> bends;
  std::vector<int32_t> triangle_bend;
  CameraMotion camera_motion;
  float moves_from = 0, moves_rate = 1;  // time = (u - from) rate, cut to [0, 1], u through the exposure
  /// Through the exposure by which i / kShutterSteps of its light has come; empty if it comes evenly.
  std::vector<float> shutter_times;
  static constexpr int kShutterSteps = 256;

  std::vector<int32_t> primitive_material;  // per primitive
  std::vector<int32_t> primitive_light;     // per primitive: index into lights, or -1
  /// Per primitive: kFlip...; kUnseen: hidden from the camera; kMasked: it has an alpha mask.
  std::vector<int32_t> primitive_flags;
  static constexpr int32_t kFlip = 1, kHasUv = 2, kFibre = 4, kPane = 8, kUnseen = 16, kMasked = 32;

  // For Cryptomatte (common/film/cryptomatte/). Names of meshes are in MeshRange.
  MatteTable mattes;
  std::vector<PartNames> sphere_names;    // per sphere
  std::vector<PartNames> instance_names;  // per instance; empty if none has any
  MatteKey matte_key_of(int32_t prim, int32_t instance) const;

  // Light groups (common/job/light_groups.h). Numbers are places in the list.
  LightGroups light_groups;
  std::vector<int32_t> medium_groups;  // per medium, of its emission; empty if there is one group at most
  /// Puts the last light into the group of this name; one that is not in the list: into the rest.
  void join_light_group(const std::string& name) {
    if (light_groups.size() > 1) lights.join_group(light_group_number(name));
  }
  int32_t light_group_number(const std::string& name) const {
    const auto found = std::find(light_groups.begin(), light_groups.end(), name);
    return static_cast<int32_t>(
        std::min<ptrdiff_t>(found - light_groups.begin(), std::ssize(light_groups) - 1));
  }
  // Participating media (medium.h) and panes (pane.h); empty without any.
  std::vector<float> media;              // kMediumFloats per medium, of which the first is empty space
  std::vector<int32_t> primitive_media;  // sides per primitive
  VolumeTable volumes;                   // of media that vary
  /// Kinds of rays that something is hidden from: shapes, instances or lights. 0: none is.
  RayKinds hides = 0;
  bool any_boundaries = false;  // that rays pass straight through: of media, or panes
  bool any_panes = false;
  int32_t camera_medium = 0;  // that camera paths start in
  int32_t outer_medium = 0;   // beyond all boundaries

  std::vector<float> bodies;  // kBodyFloats per material with a subsurface walk (subsurface_body.h)

  std::vector<MaterialEntry> materials;
  std::vector<float> material_params;  // kBsdfParams per material
  std::vector<int32_t> material_kind;
  /// Rows of albedo_table.h; they begin with the metallic table if there are materials that need it.
  std::vector<float> bsdf_tables;
  std::vector<MetallicRoughnessMaterial> metallic;
  std::vector<TransmissionMaterial> tinted;
  std::vector<PrincipledMaterial> principled;
  std::vector<ClosureMaterial> closures;
  bool energy_compensation = false;  // see conductor.h
  bool any_anisotropy = false;       // some lobe follows dp/du
  bool any_mix = false;              // some material is a mix
  bool any_weighted_mix = false;     // the same by one of Blender's rules
  bool any_texture = false;          // some material or emitter is textured
  bool any_normals = false;          // some mesh has shading normals
  bool any_colors = false;           // some mesh has vertex colours, and some texture reads them
  bool any_second_uvs = false;       // some mesh has a second set of uvs, and some image is looked up by it
  bool any_delta = false;            // some material has a delta lobe
  bool any_bumps = false;            // some material has a normal map or a displacement
  bool any_tangent = false;          // something reads dp/du (a normal map, bumps, anisotropy)
  bool records_uvs = false;          // texture coordinates are wanted at every hit, read or not
  bool any_alpha = false;            // some mesh has an alpha mask
  bool any_fibres = false;           // some mesh is of hair or flat curves (fibre.h)
  bool any_bodies = false;           // some material has a subsurface walk
  int kinds_present = 0;             // number of BSDF kinds in use
  bool only_diffuse = false;         // no other kind is in use
  bool only_diffuse_joined = false;  // no other kind with more than delta lobes is in use
  Features overrides = 0;            // kept although nothing needs them: their flags above are set

  /// Parts of the scene that are not rendered as they say: each with its place.
  std::vector<Problem> warnings;

  TextureTable textures;
  LightTable lights;
  // The lights with an emission guide (training/emission_guide_training.h), if that may pay, and the noise of
  // the image without it over that with it.
  std::optional<LightTable> guided_lights;
  double emission_guide_gain = 1;
  const LightTable& lights_of(bool guided_emission) const {
    return guided_emission && guided_lights ? *guided_lights : lights;
  }
  PhotonGuide caustics;
  ManifoldSeeds manifolds;             // empty unless walks bring light that is missing without them
  float bounds_center[3] = {0, 0, 0};  // sphere around everything, normalised space
  float bounds_radius = 1;
  float media_reach = 1;    // radius of the sphere around its center at which media without boundary end
  double surface_area = 0;  // of all primitives, normalised space

  /// A point of scene units in normalised space.
  Vec3d normalised_point(const Vec3d& p) const {
    return {std::ldexp(p.x - origin.x, scale_exponent), std::ldexp(p.y - origin.y, scale_exponent),
            std::ldexp(p.z - origin.z, scale_exponent)};
  }
  /// A point of normalised space in scene units.
  Vec3d scene_point(const Vec3f& p) const {
    return {origin.x + std::ldexp(double{p.x}, -scale_exponent),
            origin.y + std::ldexp(double{p.y}, -scale_exponent),
            origin.z + std::ldexp(double{p.z}, -scale_exponent)};
  }
  /// Whether segments are walked along because there are media or panes.
  bool any_media() const { return !media.empty(); }
  /// Number of media, without the empty space that panes ask for.
  size_t medium_count() const { return media.empty() ? 0 : media.size() / kMediumFloats - 1; }
  /// Whether light passes the primitive straight: a boundary of media, or a pane.
  bool is_passed(int32_t prim) const {
    return any_boundaries && primitive_media[static_cast<size_t>(prim)] < 0;
  }
  /// Whether camera paths keep the kinds of their rays.
  bool tracks_ray_kinds() const { return hides != 0 || textures.any_of_ray(); }
  /// Whether the camera does not see the primitive (in an instance, or -1).
  bool is_unseen(int32_t prim, int32_t instance) const {
    if (primitive_flags[static_cast<size_t>(prim)] & kUnseen) return true;
    return instance >= 0 && !instance_hidden.empty() &&
           is_hidden(instance_hidden[static_cast<size_t>(instance)], kCameraRays);
  }
  /// Whether shading normals may differ from geometric ones.
  bool any_shading_normals() const { return any_normals || any_bumps; }
  int32_t triangle_count() const { return static_cast<int32_t>(indices.size() / 3); }
  int32_t sphere_count() const { return static_cast<int32_t>(spheres.size() / 4); }
  int32_t instance_count() const { return static_cast<int32_t>(instance_object.size()); }
  bool any_instances() const { return !instance_object.empty(); }
  bool any_moving() const { return !ways.empty() || lights.any_moving() || volumes.any_moving(); }
  bool any_bending() const { return !bends.empty(); }
  bool moves() const { return any_moving() || camera_motion.moves; }
  /// The time at which the fraction `u` of the exposure's light has come, in [0, 1).
  template <class F>
  F time_at(F u) const {
    if (!shutter_times.empty()) {
      const F step = u * static_cast<float>(kShutterSteps);
      const IntOf<F> i = to_int(step);
      const F begin = gather(shutter_times.data(), i), end = gather(shutter_times.data() + 1, i);
      u = begin + (end - begin) * (step - to_float(i));
    }
    return clamp((u - moves_from) * moves_rate, 0.0f, 1.0f);
  }
  size_t world_mesh_count() const { return objects.empty() ? meshes.size() : objects.front().first_mesh; }
  int32_t world_sphere_count() const {
    return objects.empty() ? sphere_count() : objects.front().first_sphere;
  }
};

/// Builds the scene. Throws Error(kBadScene) for geometry that can't be rendered and images that can't be
/// read. A scene without geometry or light is fine: the image is what it says.
RenderScene build_scene(const SceneDescription& description, bool energy_compensation = false,
                        Features overrides = 0, const BuildOptions& options = 1);

/// Memory of its large arrays and textures, in bytes.
uint64_t bytes_of(const RenderScene& scene);

}  // namespace lightmill
