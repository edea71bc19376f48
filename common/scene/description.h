#pragma once
// A scene as its file describes it, free of any file format and of any renderer.
//
// Geometry keeps the file's object-space floats and a double transform; the renderer's scene builder
// decides how to normalise. Colours are linear Rec.709 (sRGB primaries). Vectors index each other by
// position. Units are the file's.
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/job/aovs.h"
#include "common/scene/cryptomatte/part_names.h"
#include "common/scene/material_description.h"
#include "common/scene/medium_description.h"
#include "common/scene/visibility/ray_kinds.h"

namespace lightmill {

// --- shapes ---------------------------------------------------------------------------------------

/// The vertices of a mesh at one time; `normals` is empty or as long as `positions`.
struct MeshStep {
  std::vector<Vec3f> positions, normals;
};
/// Object-space triangles. `normals`, `uvs`, `second_uvs` and `colors` (linear RGB and alpha) are empty or
/// one per vertex. Tangents follow `uvs`; image textures may choose either set.
struct TriangleMesh {
  std::vector<Vec3f> positions;
  std::vector<Vec3f> normals;
  std::vector<Vec2f> uvs, second_uvs;
  std::vector<std::array<float, 4>> colors;
  std::vector<std::array<uint32_t, 3>> triangles;
  /// Round tubes, their normals outwards. A fibre (of hair, or flat) is shaded as a ribbon along the tube's
  /// axis that faces whoever looks at it, and does not shade itself: rays leave it freely.
  bool tube = false, flat = false;
  /// Of a mesh that bends while the shutter is open: its vertices at even times after that of `positions`, up
  /// to the closing; a power of two of them, with normals if there are `normals`. Between two steps vertices
  /// go straight.
  std::vector<MeshStep> later;
};
struct MeshShape {
  std::shared_ptr<const TriangleMesh> mesh;
};
struct SphereShape {
  float radius = 1;
};
using ShapeKind = std::variant<MeshShape, SphereShape>;
struct ShapeDescription {
  ShapeKind kind;
  Transform object_to_world;
  bool reverse_orientation = false;  // ReverseOrientation was in force; see surface_flips_normal
  int material = -1;                 // index into materials
  int area_light = -1;               // index into area_lights, or -1
  SourceLocation location;
  FloatInput alpha{1, -1};  // cut-out: the fraction of rays that the surface stops, in [0, 1]
  MediumInterface media{};
  bool boundary = false;  // of media alone, without a surface: rays pass straight on
  int moves_to = -1;      // index into SceneDescription::later, or -1: it stands still
  RayKinds hidden = 0;    // that do not meet it
  /// How far the vertices of a mesh move along their normals, in the object's space. First its edges are
  /// split until none is longer than edge_length (scene units); 0: they are not.
  FloatInput displacement{0, -1};
  float edge_length = 0;
  PartNames names = {};  // for Cryptomatte
};

/// Shapes that are there once, wherever instances put them; their object_to_world goes to the object's space.
struct ObjectDescription {
  std::string name;
  std::vector<ShapeDescription> shapes;
};
/// One more occurrence of an object; its transform is affine and not singular.
struct InstanceDescription {
  int object = -1;    // index into SceneDescription::objects
  int moves_to = -1;  // as a shape's
  Transform object_to_world;
  RayKinds hidden = 0;   // that do not meet it, beside those of the object's shapes
  PartNames names = {};  // go before those of the object's shapes
};

// --- lights ---------------------------------------------------------------------------------------

/// Emits `radiance` (scale applied) from the side of the shape's outward normal, or from both sides; times a
/// texture, if there is one, whose negative values count as 0. The shape's alpha cuts the emission out, too,
/// except that a constant alpha of 0 makes an emitter that shines and is not there for any ray (pbrt's rule).
struct AreaLightDescription {
  Rgb radiance;
  bool two_sided = false;
  SourceLocation location;
  int texture = -1;                // index into SceneDescription::textures, or -1
  bool of_mean_luminance = false;  // `radiance` is for a texture of mean luminance 1: divide by what it has
  std::string light_group = {};    // of the AOV `lightgroups`; empty: none
};
/// Point light: intensity in W/sr per channel, at object_to_world * 0.
struct PointLight {
  Rgb intensity;
  Vec3d position;
  double radius = 0;  // > 0: a facing lamp (worker/render/light/lamp.h) of this intensity from afar
};
/// A rectangle or an ellipse of even radiance, [-1, 1] x [-1, 1] of the lamp's plane z = 0 by the half sides,
/// which shines along -z and stops no ray.
struct AreaLamp {
  Rgb radiance;  // of a lamp without a spread, which keeps the power
  Transform light_to_world = {};
  double half_width = 0.5, half_height = 0.5;
  bool ellipse = false;
  /// Below 180: radiance falls as 1 - tan(a) / tan(spread / 2) with the angle a to -z.
  double spread_degrees = 180;
};
/// Environment radiance: constant, or `radiance` times a square equal-area image (pbrt-v4's mapping, +z of
/// the light's space in the middle of the picture) or a panorama.
struct InfiniteLight {
  Rgb radiance;
  std::string image_path = {};  // resolved; empty: constant
  Transform light_to_world = {};
  double illuminance = 0;  // of an image: > 0 scales the radiance so that what faces +z receives this much
  /// The image is a panorama of any resolution instead: its middle is -x, right of that -z, its top +y.
  bool lat_long = false;
  int least_side = 0;  // of the panorama's picture by area: finer than this, texels go over into each other
  /// World space. The light comes only along rays that leave through this rectangle, to the side of (fourth -
  /// first) x (second - first).
  std::optional<std::array<Vec3d, 4>> portal = {};
};
/// Light from afar: `irradiance` on a surface that faces it; shines along the unit vector
/// `direction`, or along all directions that differ from it by at most half_angle_degrees (0 to
/// 90), evenly: a sun, which is seen.
struct DistantLight {
  Rgb irradiance;
  Vec3d direction;
  double half_angle_degrees = 0;
};
/// Half angle of the narrowest cone, in degrees: directions in float are not known better.
inline constexpr double kLeastCone = 1e-6;
/// Point light within a cone: intensity (W/sr) times a smoothstep from total_width to falloff_start (half
/// angles, degrees) around the unit axis `direction`.
struct SpotLight {
  Rgb intensity;
  Vec3d position, direction;
  double falloff_start = 25, total_width = 30;
  bool falls_as_cosine = false;  // too: Cycles' spots
  double radius = 0;             // as a point light's
};
/// Point light at the origin of its space: `intensity` (W/sr) times the mean channel of a square equal-area
/// image, the mapping's z axis being the light's y and its y the light's z (pbrt).
struct GoniometricLight {
  Rgb intensity;
  std::string image_path;  // resolved
  Transform light_to_world = {};
  double power = 0;       // W; > 0: `intensity` is scaled as if the image alone shone with this power
  bool lat_long = false;  // as InfiniteLight's
};
/// Point light at the origin of its space that throws an image through a window around +z: `intensity` (W/sr)
/// times the image, whose top is at +y and whose left at -x.
struct ProjectionLight {
  Rgb intensity;
  std::string image_path;  // resolved
  Transform light_to_world = {};
  double fov_degrees = 90;  // full angle of the window's shorter side, within (0, 180)
  double power = 0;         // as above, of the image's luminance
};
using LightKind = std::variant<PointLight, InfiniteLight, DistantLight, SpotLight, GoniometricLight,
                               ProjectionLight, AreaLamp>;
struct LightDescription {
  LightKind kind;
  SourceLocation location;
  int medium = -1;  // that it stands in, or that lies between the scene and a light at infinity
  /// Of a point, a spot, a lamp or a distant light of no width that moves while the shutter is open: it at
  /// even times after that of `kind`, up to the closing; a power of two of them. Positions and axes go
  /// straight between.
  std::vector<LightKind> later = {};
  /// That do not see it; of shadow rays, nothing follows.
  RayKinds hidden = 0;
  std::string light_group = {};  // of the AOV `lightgroups`; empty: none
};

// --- camera, film, sampling -----------------------------------------------------------------------

enum class CameraKind { kPerspective, kOrthographic, kSpherical, kRealistic, kFisheye };
/// Of a spherical camera, whose picture shows all directions. Equirectangular: the azimuth from
/// +x over +z grows with x, the angle from +y with y. Equal-area: the octahedral square of
/// pbrt-v4, its y and z exchanged.
enum class SphericalMapping { kEqualArea, kEquirectangular };
/// Of an equirectangular picture that is laid out as Blender's: degrees. Longitude 0 is +z, and grows to +x;
/// latitude grows to +y.
struct PanoramaRange {
  double longitude_min = -180, longitude_max = 180, latitude_min = -90, latitude_max = 90;
};
/// Of a fisheye camera: what the angle to +z grows with from the middle of the picture. Equidistant: as the
/// distance, to half the field of view at the middles of the edges. Equisolid: its half's sine, by a lens
/// before a sensor. Mirror ball: its half's sine, to 180 degrees at the middles of the edges. Polynomial: the
/// angle is one of the distance on the sensor.
enum class FisheyeProjection { kEquidistant, kEquisolid, kMirrorBall, kPolynomial };
struct FisheyeLens {
  FisheyeProjection projection = FisheyeProjection::kEquidistant;
  double fov_degrees = 180;    // full; nothing is seen beyond
  double focal_length = 10.5;  // mm; equisolid
  double sensor_width = 36, sensor_height = 24;
  std::array<double, 5> coefficients{0, 0.02, 0, 0, 0};  // of powers 0 to 4 of mm; radians
};
/// The stop of a thin lens, Blender's: a regular polygon in the disk of its radius, if it has three blades or
/// more, turned, and then squeezed in width by the ratio.
struct LensBlades {
  int count = 0;
  double rotation_degrees = 0, ratio = 1;
};
/// One interface of a lens system, in mm: radius of curvature (> 0: its centre lies towards the film; 0: the
/// aperture stop), distance to the next one, index of what lies between (0: air), diameter.
struct LensElement {
  double radius = 0, thickness = 0, eta = 0, diameter = 0;
};
/// A system of lenses: its film lies in the plane z = 0 of camera space, whose unit is the metre.
struct LensSystem {
  std::vector<LensElement> elements;  // the one towards the scene first
  double aperture_diameter = 1;       // mm, of the stop
  double focus_distance = 10;         // m, from the film
  double film_diagonal = 35;          // mm
  /// What the stop lets through: "" (a disk), "gaussian", "square", "pentagon", "star", or an image file.
  std::string aperture;
};
/// Camera space: +x right, +y up, +z into the scene (pbrt, left-handed). A perspective camera with a lens
/// radius > 0 has rays that leave a disk of that radius around the origin and meet at the plane z =
/// focal_distance (both in camera space units). An orthographic camera's rays run along +z from the plane z =
/// 0, of which it shows screen_window; with a lens radius, likewise from a disk around their point of it.
struct CameraDescription {
  CameraKind kind = CameraKind::kPerspective;
  Transform camera_to_world;
  double fov_degrees = 90;  // perspective: of the shorter image axis, or as screen_window says
  std::optional<std::array<double, 4>> screen_window;  // x0,x1,y0,y1
  std::optional<double> frame_aspect_ratio;
  double lens_radius = 0;       // 0: pinhole
  double focal_distance = 1e6;  // > 0
  LensBlades blades;            // of a perspective camera
  SphericalMapping mapping = SphericalMapping::kEqualArea;
  std::optional<PanoramaRange> range;  // of an equirectangular picture; none: as SphericalMapping says
  FisheyeLens fisheye;
  int medium = -1;    // that it stands in
  LensSystem lens;    // realistic
  int moves_to = -1;  // as a shape's, of camera_to_world, whose stretch stays the same
};
/// When things move: from their object_to_world to what `moves_to` says, both fractions of the time that the
/// shutter is open. Before and after they stand still.
struct ShutterDescription {
  double moves_from = 0, moves_until = 1;  // 0 <= from < until <= 1
  /// How far the shutter is open, at even times from its opening to its closing, straight between them. Not
  /// below 0, and somewhere above. Empty: all the time in full.
  std::vector<double> openness;
};
struct FilmDescription {
  int width = 1280, height = 720;
  std::optional<std::array<double, 4>> crop;  // x0,x1,y0,y1 in [0,1]
  std::string filename = "pbrt.exr";
  double imaging_ratio = 1;  // exposure: every radiance is multiplied by it
  /// What the sensor makes of linear Rec.709, row-major.
  std::array<double, 9> sensor{1, 0, 0, 0, 1, 0, 0, 0, 1};
  /// Samples whose largest component is above this are scaled down to it; 0: none.
  double most = 0;
  Aovs aovs = 0;  // layers that the film asks for
};
enum class FilterKind { kBox, kTriangle, kGaussian, kMitchell, kSinc };
/// Pixel reconstruction filter, importance-sampled. Radii in pixels. Mitchell's and the windowed sinc have
/// negative lobes.
struct FilterDescription {
  FilterKind kind = FilterKind::kGaussian;
  double xradius = 1.5, yradius = 1.5;
  double sigma = 0.5;               // gaussian
  double b = 1.0 / 3, c = 1.0 / 3;  // mitchell: its parameters, over the radius
  double tau = 3;                   // sinc: half width of Lanczos' window
};
struct SamplingDescription {
  std::string integrator = "volpath";  // as the file names it
  int64_t spp = 16;
  int max_depth = 5;  // kUnlimitedDepth: no limit
  uint64_t seed = 0;
};

// --- files and problems -----------------------------------------------------------------------------

/// A file that the scene reads: its name as the bundle knows it (relative, '/' separated) and where it is.
struct SourceFile {
  std::string name;
  std::string path;
};

enum class Severity { kWarning, kError };
/// One finding of the reader. Unsupported features are warnings unless `--strict`.
struct Problem {
  SourceLocation where;
  Severity severity = Severity::kError;
  std::string message;
};

/// When a glTF scene with animations is shown.
struct PoseChoice {
  /// Of the animation that is shown, or its number from 0; "all", "none", or empty: the first, and those that
  /// move nothing that an earlier one does.
  std::string animation;
  std::optional<double> time;  // seconds; not given, and nothing else either: as the nodes of the file stand
  double opens = 0, closes = 0;  // of the shutter, in seconds after that; equal: nothing blurs

  bool operator==(const PoseChoice&) const = default;
  bool is_given() const { return *this != PoseChoice{}; }
};

struct SceneDescription {
  CameraDescription camera;
  FilmDescription film;
  FilterDescription filter;
  SamplingDescription sampling;
  std::vector<TextureDescription> textures;
  std::vector<MaterialDescription> materials;
  std::vector<AreaLightDescription> area_lights;
  std::vector<MediumDescription> media;
  std::vector<ShapeDescription> shapes;
  std::vector<ObjectDescription> objects;  // of which only instances are seen
  std::vector<InstanceDescription> instances;
  /// Transforms that things which move end up with, affine and of the handedness that they begin with; things
  /// of the same index begin alike, too.
  std::vector<Transform> later;
  /// Where what ends with later[i] is at even times before that, if not on the way of motion.h from its
  /// beginning: a power of two less one of transforms, by i.
  std::map<int, std::vector<Transform>> between;
  ShutterDescription shutter;
  NameList names;  // of shapes and instances, for Cryptomatte
  std::vector<LightDescription> lights;
  std::vector<SourceFile> files;  // the scene file first
  std::string format;             // of the scene file: "pbrt-v4", "pbrt-v3" or "glTF 2.0"
  // What LoadOptions chose, the environment by its name in a bundle; empty: as the scene file says.
  std::string chosen_camera, chosen_environment;
  bool missing_textures = false, strict_lights = false;  // as LoadOptions said
  PoseChoice pose;                                       // likewise
};

/// A mix among `materials` that contains itself, directly or not; -1 if there is none.
int mix_in_a_cycle(const std::vector<MaterialDescription>& materials);

/// True if the shading/emitting normal (the geometric normal of the transformed winding) must be flipped:
/// pbrt flips when ReverseOrientation differs from "the transform swaps handedness".
bool surface_flips_normal(const ShapeDescription& shape);

}  // namespace lightmill
