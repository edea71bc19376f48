// Blender's shader nodes (docs/blender-materials.md). pbrt does not know these materials: they are what our
// exporter writes.
#include <optional>
#include <utility>

#include "common/scene/pbrt/materials/blender_parts.h"

namespace lightmill {
namespace {

constexpr double kAnyNumber = 1e6;

/// The parameters of one node.
class Sockets {
 public:
  Sockets(PbrtScene& out, ParameterList& params) : out_(out), params_(params) {}

  SpectrumInput color(std::string_view name, float fallback = 0.8f) {
    return out_.spectrum_input(params_, name, SpectrumUse::kFactor, {fallback, fallback, fallback});
  }
  FloatInput share(std::string_view name, float fallback) {
    return out_.float_input(params_, name, fallback, 0, 1);
  }
  FloatInput number(std::string_view name, float fallback, double low = -kAnyNumber,
                    double high = kAnyNumber) {
    return out_.float_input(params_, name, fallback, low, high);
  }
  FacetShape facets(FacetShape fallback, const std::vector<std::string_view>& known) {
    const std::string name = params_.text("distribution", "");
    if (name.empty()) return fallback;
    constexpr std::pair<std::string_view, FacetShape> kShapes[] = {
        {"ggx", FacetShape::kGgx},
        {"multi_ggx", FacetShape::kMultiGgx},
        {"beckmann", FacetShape::kBeckmann},
        {"ashikhmin_shirley", FacetShape::kAshikhminShirley},
        {"sharp", FacetShape::kSharp}};
    for (const auto& [word, shape] : kShapes) {
      if (word == name && is_one_of(name, known)) return shape;
    }
    params_.odd_value("distribution",
                      "is unknown: " + in_quotes(name) + nearest_hint(name, known, "\"ggx\" is taken"));
    return FacetShape::kGgx;
  }

 private:
  PbrtScene& out_;
  ParameterList& params_;
};

PrincipledMaterial read_principled(PbrtScene& out, ParameterList& params) {
  Sockets in(out, params);
  PrincipledMaterial m;
  m.base_color = in.color("base_color");
  m.metallic = in.share("metallic", 0);
  m.specular = in.share("specular", 0.5f);
  m.specular_tint = in.share("specular_tint", 0);
  m.roughness = in.share("roughness", 0.5f);
  m.anisotropic = in.share("anisotropic", 0);
  m.anisotropic_rotation = in.number("anisotropic_rotation", 0);
  m.sheen = in.share("sheen", 0);
  m.sheen_tint = in.share("sheen_tint", 0.5f);
  m.clearcoat = in.share("clearcoat", 0);
  m.clearcoat_roughness = in.share("clearcoat_roughness", 0.03f);
  m.ior = in.number("ior", 1.45f, 0, 1000);
  m.transmission = in.share("transmission", 0);
  m.transmission_roughness = in.share("transmission_roughness", 0);
  m.multi_ggx = in.facets(FacetShape::kGgx, {"ggx", "multi_ggx"}) == FacetShape::kMultiGgx;
  return m;
}

bool may_be(const FloatInput& x) { return x.texture >= 0 || x.value > 0; }

/// The body below the surface of a Principled BSDF, if it has one. Its colour is mixed of two.
std::optional<SubsurfaceMaterial> read_body(PbrtScene& out, ParameterList& params,
                                            const PrincipledMaterial& m) {
  const float share = read_constant(out, params, "subsurface", 0, 0, 1);
  const SpectrumInput color =
      out.spectrum_input(params, "subsurface_color", SpectrumUse::kFactor, {0.8f, 0.8f, 0.8f});
  const Rgb radius = read_blender_radius(out, params, "subsurface_radius");
  const float ior = read_constant(out, params, "subsurface_ior", 1.4f, 1.01, 3.8);
  const float anisotropy = read_constant(out, params, "subsurface_anisotropy", 0, 0, 1);
  if (share <= 0) return std::nullopt;
  SpectrumInput mixed = m.base_color;
  if (mixed.texture < 0 && color.texture < 0) {
    const auto blend = [&](float a, float b) { return a + (b - a) * share; };
    const Rgb &a = mixed.value, &b = color.value;
    mixed.value = {blend(a.r, b.r), blend(a.g, b.g), blend(a.b, b.b)};
  } else {
    mixed.texture = static_cast<int>(out.scene.textures.size());
    out.scene.textures.push_back({"", true, MixTexture{m.base_color, color, {share, -1}}, params.where()});
  }
  return blender_body(mixed, {radius.r * share, radius.g * share, radius.b * share}, ior, anisotropy);
}

/// The node as one material, or as a mix of its opaque part, its body and its glass.
MaterialKind principled(PbrtScene& out, ParameterList& params, const MaterialDescription& like) {
  PrincipledMaterial m = read_principled(out, params);
  const auto add = [&](MaterialKind kind) {
    MaterialDescription piece = like;
    piece.kind = std::move(kind);
    return out.add_material(std::move(piece));
  };
  MaterialKind opaque = m;
  if (const auto body = read_body(out, params, m)) {
    m.part = PrincipledMaterial::Part::kSurface;
    MixMaterial mix;
    mix.rule = MixRule::kBody;
    mix.amount = m.transmission;
    mix.metallic = m.metallic;
    mix.materials = {add(m), add(*body)};
    opaque = mix;
  }
  if (!may_be(m.transmission)) return opaque;
  m.part = PrincipledMaterial::Part::kGlass;
  MixMaterial mix;
  mix.rule = MixRule::kTransmission;
  mix.amount = m.transmission;
  mix.metallic = m.metallic;
  mix.coated = may_be(m.clearcoat);
  mix.materials = {add(opaque), add(m)};
  return mix;
}

MixMaterial read_parts(PbrtScene& out, ParameterList& params, MixRule rule) {
  MixMaterial m;
  m.rule = rule;
  m.materials = read_two_materials(out, params);
  if (rule == MixRule::kMixShader) m.amount = out.float_input(params, "factor", 0.5f, 0, 1);
  return m;
}

ClosureMaterial read_closure(PbrtScene& out, const std::string& type, ParameterList& params) {
  Sockets in(out, params);
  ClosureMaterial m;
  // Blender's defaults.
  const bool white = type == "glass_bsdf" || type == "refraction_bsdf" || type == "transparent_bsdf";
  m.color = in.color("color", white ? 1 : 0.8f);
  if (type == "diffuse_bsdf") {
    m.roughness = in.share("roughness", 0);
  } else if (type == "glossy_bsdf") {
    m.closure = ClosureKind::kGlossy;
    m.roughness = in.share("roughness", 0.5f);
    m.anisotropy = in.number("anisotropy", 0, -1, 1);
    m.rotation = in.number("rotation", 0);
    m.facets = in.facets(FacetShape::kGgx, {"sharp", "ggx", "multi_ggx", "beckmann", "ashikhmin_shirley"});
  } else if (type == "glass_bsdf" || type == "refraction_bsdf") {
    m.closure = type == "glass_bsdf" ? ClosureKind::kGlass : ClosureKind::kRefraction;
    m.roughness = in.share("roughness", 0);
    m.ior = in.number("ior", 1.45f, 0, 1000);
    m.facets = in.facets(FacetShape::kGgx, {"sharp", "ggx", "multi_ggx", "beckmann"});
  } else if (type == "translucent_bsdf") {
    m.closure = ClosureKind::kTranslucent;
  } else if (type == "transparent_bsdf") {
    m.closure = ClosureKind::kTransparent;
  } else if (type == "holdout") {
    m.closure = ClosureKind::kHoldout;
  } else if (type == "velvet_bsdf") {
    m.closure = ClosureKind::kVelvet;
    m.roughness = in.share("sigma", 1);
  } else if (type == "toon_bsdf") {
    m.closure = ClosureKind::kToon;
    m.roughness = in.share("size", 0.5f);
    m.anisotropy = in.share("smooth", 0);
    const std::string component = params.text("component", "diffuse");
    m.glossy = component == "glossy";
    if (!m.glossy && component != "diffuse")
      params.odd_value("component", "is unknown: " + in_quotes(component) + "; \"diffuse\" is taken");
  }
  return m;
}

}  // namespace

const std::vector<std::string_view>& blender_materials() {
  static const std::vector<std::string_view> names = {
      "principled",       "diffuse_bsdf",         "glossy_bsdf", "glass_bsdf", "refraction_bsdf",
      "translucent_bsdf", "transparent_bsdf",     "velvet_bsdf", "toon_bsdf",  "subsurface_bsdf",
      "hair_bsdf",        "principled_hair_bsdf", "holdout",     "mix_bsdf",   "add_bsdf"};
  return names;
}

MaterialKind read_blender_material(PbrtScene& out, const std::string& type, ParameterList& params,
                                   const MaterialDescription& like) {
  if (type == "principled") return principled(out, params, like);
  if (type == "mix_bsdf") return read_parts(out, params, MixRule::kMixShader);
  if (type == "add_bsdf") return read_parts(out, params, MixRule::kAddShader);
  if (type == "subsurface_bsdf") return read_blender_subsurface(out, params);
  if (type == "hair_bsdf" || type == "principled_hair_bsdf") return read_blender_hair(out, type, params);
  return read_closure(out, type, params);
}

}  // namespace lightmill
