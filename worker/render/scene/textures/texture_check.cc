#include "worker/render/scene/textures/texture_check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <utility>

namespace lightmill {
namespace {

/// Of all channels.
struct Range {
  float low = 0, high = 0;
};

Range hull(const Range& a, const Range& b) { return {std::min(a.low, b.low), std::max(a.high, b.high)}; }
Range product(const Range& a, const Range& b) {
  const float p[4] = {a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high};
  return {*std::min_element(p, p + 4), *std::max_element(p, p + 4)};
}
Range of(const Rgb& c) { return {std::min({c.r, c.g, c.b}), std::max({c.r, c.g, c.b})}; }

class Checker {
 public:
  Checker(const SceneDescription& description, const TextureTable& textures)
      : in_(description), textures_(textures), known_(description.textures.size()) {}

  std::vector<Problem> run() {
    for (const MaterialDescription& m : in_.materials) {
      material_ = &m;
      std::visit([&](const auto& kind) { inputs_of(kind); }, m.kind);
      if (m.normal_map >= 0) normal_map(m.normal_map);
    }
    for (size_t i = 0; i < in_.textures.size(); ++i) finite_texels(static_cast<int>(i));
    return std::move(found_);
  }

 private:
  void inputs_of(const DiffuseMaterial& m) { unit("reflectance", m.reflectance); }
  void inputs_of(const DiffuseTransmissionMaterial& m) {
    unit("reflectance", m.reflectance);
    unit("transmittance", m.transmittance);
  }
  void inputs_of(const ConductorMaterial& m) {
    if (m.reflectance) unit("reflectance", *m.reflectance);
    at_least_zero("eta", m.eta);
    at_least_zero("k", m.k);
    roughness(m.roughness);
  }
  void inputs_of(const DielectricMaterial& m) { roughness(m.roughness); }
  void inputs_of(const ThinDielectricMaterial&) {}
  void inputs_of(const CoatedDiffuseMaterial& m) {
    unit("reflectance", m.reflectance);
    roughness(m.roughness);
  }
  void inputs_of(const CoatedConductorMaterial& m) {
    inputs_of(m.conductor);
    roughness(m.coat_roughness);
  }
  void inputs_of(const HairMaterial& m) {
    at_least_zero("sigma_a", m.sigma_a);
    if (m.reflectance) unit("reflectance", *m.reflectance);
  }
  void inputs_of(const MixMaterial& m) { unit("amount", m.amount.texture); }
  // Blender clamps what its nodes are given, and says nothing.
  void inputs_of(const PrincipledMaterial&) {}
  void inputs_of(const ClosureMaterial&) {}
  // glTF's own: factors are checked by the reader, and images of a glTF file are of bytes.
  void inputs_of(const MetallicRoughnessMaterial& m) { unit("baseColorTexture", m.base_color); }
  void inputs_of(const TransmissionMaterial& m) { unit("baseColorTexture", m.color); }
  void inputs_of(const MeasuredMaterial&) {}
  void inputs_of(const SubsurfaceMaterial& m) {
    if (m.reflectance) unit("reflectance", *m.reflectance);
  }

  void roughness(const Roughness& r) {
    unit("roughness", r.u.texture);
    if (r.v.texture != r.u.texture) unit("roughness", r.v.texture);
  }
  void unit(const char* input, const SpectrumInput& in) { unit(input, in.texture); }
  void unit(const char* input, int texture) { within(input, texture, 1); }
  void at_least_zero(const char* input, const SpectrumInput& in) {
    within(input, in.texture, std::numeric_limits<float>::infinity());
  }

  /// Warns if the texture may be negative or above `most`: a little is rounding, or a filter's ringing.
  void within(const char* input, int texture, float most) {
    if (texture < 0 || !said_.insert({texture, input}).second) return;
    constexpr float kSlack = 1e-3f;
    const Range& r = range(texture);
    if (r.low >= -kSlack && r.high <= most * (1 + kSlack)) return;
    char text[96];
    std::snprintf(text, sizeof text, "has values from %.4g to %.4g", double{r.low}, double{r.high});
    warn(texture, std::string(text) + ", but the " + input + material_name() + " is " +
                      (std::isinf(most) ? "never negative" : "within 0 and 1") + "; the rest is clamped");
  }

  std::string material_name() const {
    return material_->name.empty() ? " of the material in line " + std::to_string(material_->location.line)
                                   : " of the material \"" + material_->name + "\"";
  }

  void normal_map(int texture) {
    const ImageMap* image = textures_.image(texture);
    if (!image || !said_.insert({texture, "normals"}).second) return;
    const int64_t bad = image->inward_normals();
    if (bad > 0)
      warn(texture, "has " + std::to_string(bad) +
                        " normals that point into the surface or nowhere; they are turned to its outside");
  }

  void finite_texels(int texture) {
    const ImageMap* image = textures_.image(texture);
    if (!image || is_emission(texture)) return;  // an emitter's image is refused
    const auto texel = image->first_not_finite();
    if (texel)
      warn(texture, "holds values that are not finite, the first in texel (" + std::to_string((*texel)[0]) +
                        ", " + std::to_string((*texel)[1]) + "); they count as 0");
  }
  bool is_emission(int texture) const {
    return std::any_of(in_.area_lights.begin(), in_.area_lights.end(),
                       [&](const AreaLightDescription& l) { return l.texture == texture; });
  }

  void warn(int texture, const std::string& what) {
    const TextureDescription& t = in_.textures[static_cast<size_t>(texture)];
    std::string name = "the texture \"" + t.name + "\" ";
    if (const auto* image = std::get_if<ImageTexture>(&t.kind); image && t.name.empty())
      name = "the image \"" + image->path + "\" ";
    found_.push_back({t.location, Severity::kWarning, name + what});
  }

  Range range(const SpectrumInput& in) { return in.texture < 0 ? of(in.value) : range(in.texture); }
  Range range(const FloatInput& in) { return in.texture < 0 ? Range{in.value, in.value} : range(in.texture); }
  /// Of a texture; textures are made of earlier ones, so that this ends.
  const Range& range(int texture) {
    std::optional<Range>& slot = known_[static_cast<size_t>(texture)];
    if (!slot) {
      slot = Range{};
      slot = std::visit([&](const auto& kind) { return bounds(kind, texture); },
                        in_.textures[static_cast<size_t>(texture)].kind);
    }
    return *slot;
  }

  Range bounds(const ImageTexture&, int texture) {
    const ImageMap* image = textures_.image(texture);
    if (!image) return {0, 1};  // nothing in use shows it, and it was not read
    const auto [low, high] = image->range();
    return {low, high};
  }
  Range bounds(const ConstantTexture& t, int) { return of(t.value); }
  Range bounds(const ScaleTexture& t, int) { return product(range(t.tex), range(t.scale)); }
  Range bounds(const MixTexture& t, int) {
    const Range a = range(t.tex1), b = range(t.tex2), w = range(t.amount);
    if (w.low >= 0 && w.high <= 1) return hull(a, b);
    const Range far = product({b.low - a.high, b.high - a.low}, w);
    return {a.low + far.low, a.high + far.high};
  }
  Range bounds(const CheckerboardTexture& t, int) { return hull(range(t.tex1), range(t.tex2)); }
  Range bounds(const BilerpTexture& t, int) {
    return hull(hull(of(t.v00), of(t.v01)), hull(of(t.v10), of(t.v11)));
  }
  Range bounds(const DirectionMixTexture& t, int) { return hull(range(t.tex1), range(t.tex2)); }
  Range bounds(const DotsTexture& t, int) { return hull(range(t.inside), range(t.outside)); }
  Range bounds(const ProductTexture& t, int) { return product(range(t.a), range(t.b)); }
  Range bounds(const VertexColorTexture&, int) { return {0, 1}; }
  Range bounds(const StepTexture&, int) { return {0, 1}; }
  Range bounds(const NoiseTexture&, int) { return {0, 1}; }  // rings a little beyond
  Range bounds(const GraphTexture&, int) { return {0, 1}; }  // a graph's range is what its author made it

  const SceneDescription& in_;
  const TextureTable& textures_;
  std::vector<std::optional<Range>> known_;
  std::set<std::pair<int, std::string>> said_;
  std::vector<Problem> found_;
  const MaterialDescription* material_ = nullptr;
};

}  // namespace

std::vector<Problem> check_textures(const SceneDescription& description, const TextureTable& textures) {
  return Checker(description, textures).run();
}

}  // namespace lightmill
