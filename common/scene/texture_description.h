#pragma once
// Textures as a scene file describes them. Textures refer to each other by their place in
// SceneDescription::textures.
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/scene/scene_values.h"

namespace lightmill {

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
enum class ColorEncoding {
  kAuto,
  kSrgb,
  kLinear,
  kGamma
};  // kAuto: sRGB for integers. Floats are linear always

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
  TexelFilter filter = TexelFilter::kBilinear;
  ColorEncoding encoding = ColorEncoding::kAuto;
  float gamma = 1;
  float scale = 1;
  bool invert = false;
  bool second_uvs = false;  // looked up by the mesh's second set of texture coordinates
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
struct TextureGraph;
/// A graph of operations (`common/scene/texture_graph/texture_graph.h`).
struct GraphTexture {
  std::shared_ptr<const TextureGraph> graph;
  std::vector<int> images;  // ImageTextures that come before it, by its own numbers; mappings are not used
};
using TextureKind = std::variant<ImageTexture, ConstantTexture, ScaleTexture, MixTexture, CheckerboardTexture,
                                 BilerpTexture, DirectionMixTexture, DotsTexture, NoiseTexture,
                                 ProductTexture, VertexColorTexture, StepTexture, GraphTexture>;
struct TextureDescription {
  std::string name;
  bool is_spectrum = true;  // false: "float"; then r == g == b
  TextureKind kind;
  SourceLocation location;
};

}  // namespace lightmill
