// Texture "name" "float|spectrum" "type".
#include <algorithm>
#include <cmath>
#include <optional>

#include "common/base/error.h"
#include "common/base/parse_number.h"
#include "common/scene/pbrt/scene.h"
#include "common/scene/pbrt/syntax/params.h"
#include "common/scene/texture_graph/read_graph.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

/// An axis of a planar mapping.
Vec3d read_axis(ParameterList& params, const char* name, const Vec3d& fallback) {
  const auto* v = params.numbers(name, ParamType::kVector3, 3);
  return v == nullptr ? fallback : Vec3d{(*v)[0], (*v)[1], (*v)[2]};
}

UvMapping read_mapping(ParameterList& params, const Transform& ctm) {
  const std::string kind = params.text("mapping", "uv");
  UvMapping m;
  const auto value = [&](const char* name, double fallback) {
    return static_cast<float>(params.number(name, fallback, -kAnySize, kAnySize));
  };
  m.su = value("uscale", 1);
  m.sv = value("vscale", 1);
  m.du = value("udelta", 0);
  m.dv = value("vdelta", 0);
  m.s_axis = read_axis(params, "v1", {1, 0, 0});
  m.t_axis = read_axis(params, "v2", {0, 1, 0});
  m.world_to_texture = inverse(ctm);
  if (kind == "spherical") {
    m.kind = MappingKind::kSpherical;
  } else if (kind == "cylindrical") {
    m.kind = MappingKind::kCylindrical;
  } else if (kind == "planar") {
    m.kind = MappingKind::kPlanar;
  } else if (kind != "uv") {
    params.odd_value("mapping",
                     "is unknown: " + in_quotes(kind) +
                         nearest_hint(kind, {"uv", "spherical", "cylindrical", "planar"}, "\"uv\" is taken"));
  }
  return m;
}

Wrap read_wrap(ParameterList& params) {
  const std::string name = params.text("wrap", "repeat");
  if (name == "repeat") return Wrap::kRepeat;
  if (name == "clamp") return Wrap::kClamp;
  if (name == "black") return Wrap::kBlack;
  if (name == "octahedralsphere") return Wrap::kOctahedral;
  params.odd_value("wrap", "is unknown: " + in_quotes(name) +
                               nearest_hint(name, {"repeat", "clamp", "black", "octahedralsphere"},
                                            "\"repeat\" is taken"));
  return Wrap::kRepeat;
}

void read_encoding(ParameterList& params, ImageTexture* image) {
  const std::string name = params.text("encoding", "");
  if (name == "sRGB") {
    image->encoding = ColorEncoding::kSrgb;
  } else if (name == "linear") {
    image->encoding = ColorEncoding::kLinear;
  } else if (double gamma = 0;
             name.starts_with("gamma ") && parse_number(name.substr(6), &gamma) && gamma > 0 && gamma < 100) {
    image->encoding = ColorEncoding::kGamma;
    image->gamma = static_cast<float>(gamma);
  } else if (!name.empty()) {
    params.odd_value("encoding", "is unknown: " + in_quotes(name) +
                                     "; use \"sRGB\", \"linear\" or \"gamma 2.2\"; it is left out");
  }
}

ImageTexture read_image(PbrtScene& out, ParameterList& params, const Transform& ctm) {
  ImageTexture image;
  const std::string file = params.text("filename", "");
  if (file.empty()) {
    out.problems->error(params.where_of("filename"), params.owner() + " needs a \"string filename\"");
  } else {
    image.path = out.open_image(file, params.where_of("filename")).value_or("");
  }
  image.wrap = read_wrap(params);
  read_encoding(params, &image);
  image.scale = static_cast<float>(params.number("scale", 1, -kAnySize, kAnySize));
  image.invert = params.boolean("invert", false);
  image.mapping = read_mapping(params, ctm);
  // Others are about how a renderer makes do with few samples; this one shows its texels.
  const std::string filter = params.text("filter", "bilinear");
  static const std::vector<std::string_view> filters = {"point", "bilinear", "trilinear", "ewa", "EWA"};
  if (!is_one_of(filter, filters))
    params.odd_value("filter", "is unknown: " + in_quotes(filter) +
                                   nearest_hint(filter, filters, "\"bilinear\" is taken"));
  if (filter == "point") image.filter = TexelFilter::kNearest;
  params.accept({"maxanisotropy"});
  return image;
}

/// A texture's inputs may name only textures that are defined before it, so that there can be no cycle.
class Inputs {
 public:
  Inputs(PbrtScene& out, ParameterList& params, bool is_spectrum)
      : out_(out), params_(params), is_spectrum_(is_spectrum) {}

  SpectrumInput color(std::string_view name, float fallback) {
    if (!check(name, is_spectrum_)) return {{fallback, fallback, fallback}, -1};
    if (is_spectrum_) {
      return out_.spectrum_input(params_, name, SpectrumUse::kFactor, {fallback, fallback, fallback});
    }
    const FloatInput f = out_.float_input(params_, name, fallback, -kAnySize, kAnySize);
    return {{f.value, f.value, f.value}, f.texture};
  }
  FloatInput number(std::string_view name, float fallback) {
    if (!check(name, false)) return {fallback, -1};
    return out_.float_input(params_, name, fallback, -kAnySize, kAnySize);
  }

 private:
  /// The parameter if it names one texture; nullptr if it has a value of its own, or none.
  const Parameter* texture_name(std::string_view name) {
    if (!params_.has(name)) return nullptr;
    const Parameter* p = params_.find(name, {ParamType::kTexture, ParamType::kFloat, ParamType::kRgb,
                                             ParamType::kSpectrum, ParamType::kBlackbody});
    return p != nullptr && p->type == ParamType::kTexture && p->strings.size() == 1 ? p : nullptr;
  }
  /// Reports a texture name that is not defined yet.
  bool check(std::string_view name, bool is_spectrum) {
    const Parameter* const p = texture_name(name);
    if (p == nullptr || out_.texture_defined(p->strings[0], is_spectrum)) return true;
    if (!is_spectrum && out_.float_copy(p->strings[0]) >= 0) return true;
    params_.odd_value(name, "names the " + std::string(is_spectrum ? "spectrum" : "float") + " texture " +
                                in_quotes(p->strings[0]) + ", which is not defined above; it is left out");
    return false;
  }

  PbrtScene& out_;
  ParameterList& params_;
  bool is_spectrum_;
};

constexpr int kMaxOctaves = 64;  // beyond about 24, float has no digits left for them

std::optional<NoiseKind> noise_kind(const std::string& type) {
  if (type == "fbm") return NoiseKind::kFbm;
  if (type == "wrinkled") return NoiseKind::kWrinkled;
  if (type == "windy") return NoiseKind::kWindy;
  if (type == "marble") return NoiseKind::kMarble;
  return std::nullopt;
}

NoiseTexture read_noise(NoiseKind kind, ParameterList& params, const Transform& ctm) {
  NoiseTexture noise;
  noise.kind = kind;
  if (kind != NoiseKind::kWindy) {
    noise.octaves = static_cast<int>(params.integer("octaves", 8, 1, kMaxOctaves));
    noise.roughness = static_cast<float>(params.number("roughness", 0.5, 0, 2));
  }
  if (kind == NoiseKind::kMarble) {
    noise.scale = static_cast<float>(params.number("scale", 1, -1e6, 1e6));
    noise.variation = static_cast<float>(params.number("variation", 0.2, -1e6, 1e6));
  }
  noise.world_to_texture = inverse(ctm);
  return noise;
}

/// A corner of "bilerp".
Rgb read_corner(PbrtScene& out, ParameterList& params, const char* name, float fallback, bool is_spectrum) {
  if (is_spectrum) return out.spectrum(params, name, SpectrumUse::kFactor, {fallback, fallback, fallback});
  const auto v = static_cast<float>(params.number(name, fallback, -kAnySize, kAnySize));
  return {v, v, v};
}

ImageTexture image_of_graph(PbrtScene& out, const GraphImage& from, const SourceLocation& where) {
  ImageTexture image;
  image.path = out.open_image(from.file, where).value_or("");
  image.wrap = from.extension == "EXTEND"   ? Wrap::kClamp
               : from.extension == "CLIP"   ? Wrap::kBlack
               : from.extension == "MIRROR" ? Wrap::kMirror
                                            : Wrap::kRepeat;
  image.encoding = from.color_space == "sRGB" && !from.alpha ? ColorEncoding::kSrgb : ColorEncoding::kLinear;
  image.channel = from.alpha ? ImageChannel::kAlpha : ImageChannel::kRgb;
  image.filter = from.filter;
  return image;
}

/// Ours, not pbrt's: a texture graph (docs/texture-graph.md).
TextureKind read_graph(PbrtScene& out, bool is_spectrum, ParameterList& params, const Transform& ctm) {
  const SourceLocation where = params.where_of("filename");
  const std::string file = params.text("filename", "");
  const std::string path = file.empty() ? "" : out.open_reference(file, where);
  if (file.empty()) out.problems->error(where, params.owner() + " needs a \"string filename\"");
  if (path.empty()) return ConstantTexture{{0.5f, 0.5f, 0.5f}};
  try {
    GraphFile graph = read_texture_graph_file(path, inverse(ctm), !is_spectrum);
    GraphTexture texture{std::make_shared<const TextureGraph>(std::move(graph.graph)), {}};
    for (const GraphImage& image : graph.images) {
      texture.images.push_back(static_cast<int>(out.scene.textures.size()));
      out.scene.textures.push_back({image.file, true, image_of_graph(out, image, where), params.where()});
    }
    return texture;
  } catch (const Error& e) {
    out.problems->error(where, "the texture graph " + in_quotes(file) + ": " + e.what());
    return ConstantTexture{{0.5f, 0.5f, 0.5f}};
  }
}

TextureKind read_kind(PbrtScene& out, const std::string& type, bool is_spectrum, ParameterList& params,
                      const Transform& ctm) {
  Inputs inputs(out, params, is_spectrum);
  if (type == "imagemap") return read_image(out, params, ctm);
  if (type == "graph") return read_graph(out, is_spectrum, params, ctm);
  if (type == "constant") {
    if (is_spectrum) return ConstantTexture{out.spectrum(params, "value", SpectrumUse::kFactor, {1, 1, 1})};
    const auto v = static_cast<float>(params.number("value", 1, -kAnySize, kAnySize));
    return ConstantTexture{{v, v, v}};
  }
  if (type == "scale") return ScaleTexture{inputs.color("tex", 1), inputs.number("scale", 1)};
  if (type == "mix") {
    return MixTexture{inputs.color("tex1", 0), inputs.color("tex2", 1), inputs.number("amount", 0.5f)};
  }
  if (type == "checkerboard") {
    CheckerboardTexture board{inputs.color("tex1", 1), inputs.color("tex2", 0), {}};
    board.solid = params.integer("dimension", 2, 2, 3) == 3;
    board.mapping = read_mapping(params, ctm);
    return board;
  }
  if (type == "dots") {
    // What pbrt-v4 draws is not what its documentation says: the dots have the colour of "outside".
    const SpectrumInput ground = inputs.color("inside", 1), dots = inputs.color("outside", 0);
    return DotsTexture{dots, ground, read_mapping(params, ctm)};
  }
  if (type == "directionmix") {
    const Vec3d dir = transform_vector(ctm, read_axis(params, "dir", {0, 1, 0}));
    const double length = std::sqrt(dir.x * dir.x + dir.y * dir.y + dir.z * dir.z);
    const bool is_direction = length > 0 && std::isfinite(length);
    if (!is_direction) params.odd_value("dir", "must not be zero; 0 1 0 is taken");
    return DirectionMixTexture{
        inputs.color("tex1", 0), inputs.color("tex2", 1),
        is_direction ? Vec3d{dir.x / length, dir.y / length, dir.z / length} : Vec3d{0, 1, 0}};
  }
  if (type == "bilerp") {
    const auto corner = [&](const char* name, float fallback) {
      return read_corner(out, params, name, fallback, is_spectrum);
    };
    return BilerpTexture{corner("v00", 0), corner("v01", 1), corner("v10", 0), corner("v11", 1),
                         read_mapping(params, ctm)};
  }
  if (const auto noise = noise_kind(type)) {
    const bool wants_spectrum = *noise == NoiseKind::kMarble;
    if (is_spectrum != wants_spectrum) {
      out.problems->warning(params.where(), params.owner() + " is a " +
                                                (wants_spectrum ? "spectrum" : "float") +
                                                " texture; declare it as that");
    }
    return read_noise(*noise, params, ctm);
  }
  return ConstantTexture{{0.5f, 0.5f, 0.5f}};
}

const std::vector<std::string_view> kKnown = {"imagemap",     "constant", "scale", "mix",  "checkerboard",
                                              "directionmix", "bilerp",   "dots",  "fbm",  "wrinkled",
                                              "windy",        "marble",   "ptex",  "graph"};
const std::vector<std::string_view> kUnsupported = {"ptex"};

}  // namespace

void translate_texture(PbrtScene& out, const std::string& name, const std::string& value_type,
                       const std::string& type, ParameterList& params, const Transform& ctm) {
  const bool is_spectrum = value_type != "float";
  if (is_spectrum && value_type != "spectrum" && value_type != "color") {
    out.problems->warning(params.where(), "a texture is of type \"float\" or \"spectrum\", not " +
                                              in_quotes(value_type) + "; \"spectrum\" is taken");
  }
  TextureDescription texture{name, is_spectrum, read_kind(out, type, is_spectrum, params, ctm),
                             params.where()};
  if (is_one_of(type, kUnsupported)) {
    out.problems->unsupported(params.where(), params.owner() + " is replaced by the constant 0.5");
  } else if (is_one_of(type, kKnown)) {
    params.finish();
  } else {
    report_unknown_word(params, "texture", type, kKnown, "the constant 0.5 is taken");
  }
  out.define_texture(std::move(texture));
}

}  // namespace lightmill
