#pragma once
// A scene as its file describes it, free of any file format and of any renderer.
//
// Geometry keeps the file's object-space floats and a double transform; the renderer's scene builder
// decides how to normalise. Colours are linear Rec.709 (sRGB primaries). Vectors index each other by
// position. Units are the file's.
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace lightmill {

struct Vec2f {
  float x = 0, y = 0;
};
struct Vec3f {
  float x = 0, y = 0, z = 0;
};
struct Vec3d {
  double x = 0, y = 0, z = 0;
};
struct Rgb {
  float r = 0, g = 0, b = 0;
  bool operator==(const Rgb&) const = default;
};

/// Row-major 4x4 matrix acting on column vectors: p' = M p.
struct Transform {
  std::array<std::array<double, 4>, 4> m{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
};

/// file:line:column of a directive; column and line count from 1.
struct SourceLocation {
  std::string file;
  int line = 0, column = 0;
};

// --- textures and materials ---------------------------------------------------------------------

/// A colour or a reference to a texture (index into SceneDescription::textures).
struct SpectrumInput {
  Rgb value;
  int texture = -1;
};
struct FloatInput {
  float value = 0;
  int texture = -1;
};

enum class Wrap { kRepeat, kClamp, kBlack, kOctahedral, kMirror };
/// What a texel is: its colour, or one of its channels as a grey (alpha is 1 where the file has none).
enum class ImageChannel { kRgb, kRed, kGreen, kBlue, kAlpha };
enum class ColorEncoding { kAuto, kSrgb, kLinear, kGamma };  // kAuto: sRGB for 8-bit files, else linear

/// How a surface point becomes (s, t). Over texture space, p_t = world_to_texture p with p in scene units:
///   kUv           (su u + sv_u v + du, sv v + su_v u + dv); the mixed factors turn the picture
///   kSpherical    of p_t's direction: polar angle from +z over pi, azimuth over 2 pi
///   kCylindrical  azimuth of p_t from -x in turns, its z
///   kPlanar       (du + p_t . s_axis, dv + p_t . t_axis)
enum class MappingKind { kUv, kSpherical, kCylindrical, kPlanar };
struct UvMapping {
  float su = 1, sv = 1, du = 0, dv = 0;
  float sv_u = 0, su_v = 0;
  MappingKind kind = MappingKind::kUv;
  Vec3d s_axis{1, 0, 0}, t_axis{0, 1, 0};
  Transform world_to_texture{};
};

/// pbrt "imagemap". (0,0) is the lower left corner of the picture (pbrt flips v).
struct ImageTexture {
  std::string path;  // resolved: can be opened; with `contents` just a name for messages
  std::shared_ptr<const std::string> contents;  // the image file's bytes, if it lies inside another file
  Wrap wrap = Wrap::kRepeat;
  std::optional<Wrap> wrap_t;  // where it differs along t
  ImageChannel channel = ImageChannel::kRgb;
  bool nearest = false;  // the nearest texel instead of a blend of four
  ColorEncoding encoding = ColorEncoding::kAuto;
  float gamma = 1;
  float scale = 1;
  bool invert = false;
  UvMapping mapping;
};
struct ProductTexture {
  SpectrumInput a, b;
};
/// The mesh's vertex colour, or its alpha as a grey; 1 where the mesh has none.
struct VertexColorTexture {
  bool alpha = false;
};
/// 1 where the value is at least `edge`, else 0.
struct StepTexture {
  FloatInput value;
  float edge = 0.5f;
};
struct ConstantTexture {
  Rgb value;
};
struct ScaleTexture {
  SpectrumInput tex;
  FloatInput scale;
};
struct MixTexture {
  SpectrumInput tex1, tex2;
  FloatInput amount;
};
struct CheckerboardTexture {
  SpectrumInput tex1, tex2;
  UvMapping mapping;
  bool solid = false;  // over p_t, the mapping's texture space, instead of (s, t)
};
/// Bilinear in (s, t): vST at the corner (S, T).
struct BilerpTexture {
  Rgb v00, v01{1, 1, 1}, v10, v11{1, 1, 1};
  UvMapping mapping;
};
/// By the surface's direction: |n . direction| of tex1, the rest of tex2; n is the geometric normal.
struct DirectionMixTexture {
  SpectrumInput tex1, tex2{{1, 1, 1}, -1};
  Vec3d direction{0, 1, 0};  // unit, of the scene's space
};
/// Scattered disks of `inside` on `outside`, about one to two cells of (s, t).
struct DotsTexture {
  SpectrumInput inside, outside;
  UvMapping mapping;
};
/// Sums of gradient noise over texture space: the value itself (fbm), of absolute values (wrinkled), waves
/// under gusts (windy), veins of colour (marble).
enum class NoiseKind { kFbm, kWrinkled, kWindy, kMarble };
struct NoiseTexture {
  NoiseKind kind = NoiseKind::kFbm;
  int octaves = 8;
  float roughness = 0.5f;             // weight of an octave over the one before
  float scale = 1, variation = 0.2f;  // marble
  Transform world_to_texture{};
};
using TextureKind = std::variant<ImageTexture, ConstantTexture, ScaleTexture, MixTexture, CheckerboardTexture,
                                 BilerpTexture, DirectionMixTexture, DotsTexture, NoiseTexture,
                                 ProductTexture, VertexColorTexture, StepTexture>;
struct TextureDescription {
  std::string name;
  bool is_spectrum = true;  // false: "float"; then r == g == b
  TextureKind kind;
  SourceLocation location;
};

/// Roughness as pbrt has it: alpha = remap ? sqrt(roughness) : roughness, per tangent direction.
struct Roughness {
  FloatInput u, v;
  bool remap = true;
};

struct DiffuseMaterial {
  SpectrumInput reflectance{{0.5f, 0.5f, 0.5f}, -1};
};
/// Lambertian reflection and transmission, both sides alike. Values are times `scale`; where a channel's sum
/// is above 1, the renderer scales both down to a sum of 1.
struct DiffuseTransmissionMaterial {
  SpectrumInput reflectance{{0.25f, 0.25f, 0.25f}, -1}, transmittance{{0.25f, 0.25f, 0.25f}, -1};
  float scale = 1;
};
/// Fresnel by eta, k; or, if `reflectance` is set, by pbrt's rule eta = 1, k = 2 sqrt(r) / sqrt(1 - r).
struct ConductorMaterial {
  SpectrumInput eta, k;
  std::optional<SpectrumInput> reflectance;
  Roughness roughness;
};
struct DielectricMaterial {
  float eta = 1.5f;
  Roughness roughness;
};
/// A smooth sheet too thin to shift what is seen through it; `eta` over its surroundings.
struct ThinDielectricMaterial {
  float eta = 1.5f;
};
/// What is in a coat: the single-scattering albedo and the asymmetry g, in (-1, 1), of Henyey-Greenstein's
/// phase function. Black: the coat absorbs alone.
struct CoatMediumDescription {
  Rgb albedo;
  float g = 0;
};
/// Diffuse base under a dielectric coat, pbrt's layered model: a traversal of the coat at cosine mu transmits
/// exp(-thickness / mu), and at most max_depth interactions with coat and base are followed (those with the
/// medium are not counted).
struct CoatedDiffuseMaterial {
  SpectrumInput reflectance{{0.5f, 0.5f, 0.5f}, -1};
  float eta = 1.5f;
  Roughness roughness;
  float thickness = 0.01f;
  int max_depth = 10;
  CoatMediumDescription medium{};
};
/// Metal under a dielectric coat; the coat as above. `conductor` is the metal against air, as pbrt has it.
struct CoatedConductorMaterial {
  ConductorMaterial conductor;
  float eta = 1.5f;  // of the coat
  Roughness coat_roughness;
  float thickness = 0.01f;
  int max_depth = 10;
  CoatMediumDescription medium{};
};
/// At every point either materials[0] or, with probability `amount`, materials[1] (indices into
/// SceneDescription::materials; they may be mixes, too).
struct MixMaterial {
  std::array<int, 2> materials{-1, -1};
  FloatInput amount{0.5f, -1};
};
/// glTF's material: a diffuse base under a dielectric's specular reflection, blended with a metal of the
/// base's colour; a clear coat over both. GGX with alpha = roughness^2. The dielectric reflects min(1,
/// f0(ior) specular_color) specular at normal incidence and `specular` at grazing; ior 0 means f0 = 1. Sheen,
/// of fibres, lies on the base and below the coat; black: none.
struct MetallicRoughnessMaterial {
  SpectrumInput base_color{{1, 1, 1}, -1};
  FloatInput metallic{1, -1}, roughness{1, -1};
  float ior = 1.5f;
  FloatInput specular{1, -1};
  SpectrumInput specular_color{{1, 1, 1}, -1};
  FloatInput clearcoat{0, -1}, clearcoat_roughness{0, -1};
  SpectrumInput sheen_color{{0, 0, 0}, -1};
  FloatInput sheen_roughness{0, -1};
};
/// glTF's transmission: an interface that tints what it lets through. Thin: a sheet of which light comes out
/// in the direction in which it entered, spread by the roughness; else light is refracted into a solid of
/// index `ior`. GGX with alpha = roughness^2.
struct TransmissionMaterial {
  SpectrumInput color{{1, 1, 1}, -1};
  FloatInput roughness{0, -1};
  float ior = 1.5f;
  bool thin = true;
};
/// A fibre by Chiang et al. 2016: sigma_a per fibre radius; roughnesses along the fibre (beta_m) and around
/// it (beta_n) in [0.01, 1]; scales tilted by `alpha_degrees`. With `reflectance` (of a mass of fibres)
/// sigma_a follows from it and beta_n.
struct HairMaterial {
  SpectrumInput sigma_a{{0.5447f, 0.9061f, 1.781f}, -1};  // eumelanin 1.3
  std::optional<SpectrumInput> reflectance;
  float eta = 1.55f, beta_m = 0.3f, beta_n = 0.3f, alpha_degrees = 2;
};
/// A measured BRDF, reflecting on both sides; null: black.
struct MeasuredTable;
struct MeasuredMaterial {
  std::shared_ptr<const MeasuredTable> table;
};
using MaterialKind =
    std::variant<DiffuseMaterial, ConductorMaterial, DielectricMaterial, CoatedDiffuseMaterial,
                 ThinDielectricMaterial, DiffuseTransmissionMaterial, CoatedConductorMaterial, MixMaterial,
                 MetallicRoughnessMaterial, TransmissionMaterial, HairMaterial, MeasuredMaterial>;
struct MaterialDescription {
  std::string name;  // empty for an unnamed Material
  MaterialKind kind;
  SourceLocation location;
  /// Index of a texture that turns the shading normal: 2 rgb - 1 in the frame of dp/du, of the normal, and of
  /// their cross product. -1: none.
  int normal_map = -1;
  float normal_scale = 1;         // of the map's x and y
  bool normal_follows_v = false;  // glTF: y points along +v even where u and v are mirrored
  /// Index of a float texture of heights (scene units) along the normal that tilts the shading normal alone.
  /// -1: none. A normal map goes before it.
  int displacement = -1;
};

// --- media ----------------------------------------------------------------------------------------

/// A homogeneous participating medium. Coefficients are per scene unit, any scale applied; `emission` is the
/// radiance that it would show in infinite depth if it only absorbed. The phase function is Henyey and
/// Greenstein's with mean cosine g in (-1, 1): g > 0 scatters forwards.
struct MediumDescription {
  std::string name;
  Rgb sigma_a{1, 1, 1}, sigma_s{1, 1, 1};
  Rgb emission;
  float g = 0;
  SourceLocation location;
};
/// The media on either side of a surface (indices into SceneDescription::media; -1: empty space); outside is
/// where its outward normal points. If both are the same, what passes stays in the medium that it came
/// through, as in pbrt.
struct MediumInterface {
  int inside = -1, outside = -1;
  bool transition() const { return inside != outside; }
  bool operator==(const MediumInterface&) const = default;
};

// --- shapes ---------------------------------------------------------------------------------------

/// Object-space triangles. `normals`, `uvs` and `colors` (linear RGB and alpha) are empty or one per vertex.
struct TriangleMesh {
  std::vector<Vec3f> positions;
  std::vector<Vec3f> normals;
  std::vector<Vec2f> uvs;
  std::vector<std::array<float, 4>> colors;
  std::vector<std::array<uint32_t, 3>> triangles;
  /// Round tubes, their normals outwards. A fibre (of hair, or flat) is shaded as a ribbon along the tube's
  /// axis that faces whoever looks at it, and does not shade itself: rays leave it freely.
  bool tube = false, flat = false;
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
};

/// Shapes that are there once, wherever instances put them; their object_to_world goes to the object's space.
struct ObjectDescription {
  std::string name;
  std::vector<ShapeDescription> shapes;
};
/// One more occurrence of an object; its transform is affine and not singular.
struct InstanceDescription {
  int object = -1;  // index into SceneDescription::objects
  Transform object_to_world;
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
};
/// Point light: intensity in W/sr per channel, at object_to_world * 0.
struct PointLight {
  Rgb intensity;
  Vec3d position;
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
/// Point light within a cone: intensity (W/sr) times a smoothstep from total_width to falloff_start (half
/// angles, degrees) around the unit axis `direction`.
struct SpotLight {
  Rgb intensity;
  Vec3d position, direction;
  double falloff_start = 25, total_width = 30;
};
/// Point light at the origin of its space: `intensity` (W/sr) times the mean channel of a square equal-area
/// image, the mapping's z axis being the light's y and its y the light's z (pbrt).
struct GoniometricLight {
  Rgb intensity;
  std::string image_path;  // resolved
  Transform light_to_world = {};
  double power = 0;  // W; > 0: `intensity` is scaled as if the image alone shone with this power
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
using LightKind =
    std::variant<PointLight, InfiniteLight, DistantLight, SpotLight, GoniometricLight, ProjectionLight>;
struct LightDescription {
  LightKind kind;
  SourceLocation location;
  int medium = -1;  // that it stands in, or that lies between the scene and a light at infinity
};

// --- camera, film, sampling -----------------------------------------------------------------------

enum class CameraKind { kPerspective, kOrthographic, kSpherical, kRealistic };
/// Of a spherical camera, whose picture shows all directions. Equirectangular: the azimuth from
/// +x over +z grows with x, the angle from +y with y. Equal-area: the octahedral square of
/// pbrt-v4, its y and z exchanged.
enum class SphericalMapping { kEqualArea, kEquirectangular };
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
  SphericalMapping mapping = SphericalMapping::kEqualArea;
  int medium = -1;  // that it stands in
  LensSystem lens;  // realistic
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
  std::vector<LightDescription> lights;
  std::vector<SourceFile> files;  // the scene file first
  // What LoadOptions chose, the environment by its name in a bundle; empty: as the scene file says.
  std::string chosen_camera, chosen_environment;
};

/// A mix among `materials` that contains itself, directly or not; -1 if there is none.
int mix_in_a_cycle(const std::vector<MaterialDescription>& materials);

/// True if the shading/emitting normal (the geometric normal of the transformed winding) must be flipped:
/// pbrt flips when ReverseOrientation differs from "the transform swaps handedness".
bool surface_flips_normal(const ShapeDescription& shape);

}  // namespace lightmill
