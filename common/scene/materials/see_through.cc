#include "common/scene/materials/see_through.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "common/scene/problem_list.h"
#include "common/scene/texture_graph/texture_graph.h"

namespace lightmill {
namespace {

/// Of a surface that lets all light through and scatters as well (Add Shader): it has to be met now and then.
constexpr float kLeastOpacity = 0.03f;

constexpr Rgb kWhite{1, 1, 1};

/// The share of rays that a material stops, and the colour of the others.
struct Passing {
  FloatInput opacity{1, -1};
  Rgb tint{1, 1, 1};
};

class CutOuts {
 public:
  CutOuts(SceneDescription* scene, ProblemList* problems)
      : scene_(*scene), problems_(*problems), known_(scene->materials.size()) {}

  void run() {
    for (size_t i = 0; i < known_.size(); ++i) find(static_cast<int>(i));
    if (!any_) return;
    for (size_t i = 0; i < known_.size(); ++i) {
      scene_.materials[i].opacity = known_[i]->opacity;
      scene_.materials[i].tint = known_[i]->tint;
    }
    shapes(&scene_.shapes);
    for (ObjectDescription& object : scene_.objects) shapes(&object.shapes);
  }

 private:
  static bool is_opaque(const FloatInput& x) { return x.texture < 0 && x.value >= 1; }
  static bool same(const FloatInput& a, const FloatInput& b) {
    return a.texture == b.texture && a.value == b.value;
  }
  static SpectrumInput grey(const FloatInput& x) { return {{x.value, x.value, x.value}, x.texture}; }

  FloatInput texture(TextureKind kind) {
    scene_.textures.push_back({"", false, std::move(kind), {}});
    return {1, static_cast<int>(scene_.textures.size()) - 1};
  }
  FloatInput mixed(const FloatInput& a, const FloatInput& b, const FloatInput& amount) {
    if (same(a, b)) return a;
    if (a.texture < 0 && b.texture < 0 && amount.texture < 0)
      return {a.value + (b.value - a.value) * std::clamp(amount.value, 0.0f, 1.0f), -1};
    return texture(MixTexture{grey(a), grey(b), amount});
  }
  FloatInput added(const FloatInput& a, const FloatInput& b) {
    if (is_opaque(a) && is_opaque(b)) return a;
    if (a.texture < 0 && b.texture < 0) return {std::max(a.value + b.value - 1, kLeastOpacity), -1};
    if (a.texture >= 0 && b.texture >= 0) return {1, -1};
    const FloatInput &varies = a.texture >= 0 ? a : b, &constant = a.texture >= 0 ? b : a;
    const float least = std::max(constant.value - 1, kLeastOpacity);
    return mixed({least, -1}, {std::max(constant.value, least), -1}, varies);
  }

  /// Of a Transparent BSDF alone. A grey stops rays; a colour does not.
  Passing of_colour(const MaterialDescription& material, const SpectrumInput& color) {
    any_ = true;
    const Rgb& c = color.value;
    if (color.texture >= 0) {
      problems_.unsupported(material.location,
                            "a texture as the colour of a Transparent BSDF is taken as white");
      return {{0, -1}};
    }
    if (c.r == c.g && c.g == c.b) return {{1 - std::clamp(c.r, 0.0f, 1.0f), -1}};
    return {{0, -1}, c};
  }
  Rgb one_tint(const MaterialDescription& material, const Rgb& a, const Rgb& b) {
    if (a == kWhite || b == kWhite || a == b) return a == kWhite ? b : a;
    problems_.unsupported(material.location,
                          "of two Transparent BSDFs with a colour the first one's is taken");
    return a;
  }

  bool depends_on_ray(const FloatInput& x) const {
    if (x.texture < 0) return false;
    const auto* graph = std::get_if<GraphTexture>(&scene_.textures[static_cast<size_t>(x.texture)].kind);
    return graph && reads_ray(*graph->graph);
  }
  /// What lets shadow rays alone pass, say, can be no pane, which all rays pass alike.
  Passing without_tint(const MaterialDescription& material, const Passing& passing) {
    const Rgb& c = passing.tint;
    if (c == kWhite) return passing;
    problems_.unsupported(material.location,
                          "the colour of a Transparent BSDF whose share depends on the ray is taken as grey");
    const float grey = (c.r + c.g + c.b) / 3;
    return {mixed({1, -1}, passing.opacity, {std::clamp(grey, 0.0f, 1.0f), -1})};
  }

  /// Fills known_ for a material, after its parts; without recursion, as mixes may be nested deeply.
  void find(int root) {
    std::vector<int> open{root};
    while (!open.empty()) {
      const auto at = static_cast<size_t>(open.back());
      if (known_[at]) {
        open.pop_back();
        continue;
      }
      const MaterialDescription& material = scene_.materials[at];
      if (const auto* closure = std::get_if<ClosureMaterial>(&material.kind);
          closure && closure->closure == ClosureKind::kTransparent) {
        known_[at] = of_colour(material, closure->color);
        continue;
      }
      const auto* mix = std::get_if<MixMaterial>(&material.kind);
      if (!mix || (mix->rule != MixRule::kMixShader && mix->rule != MixRule::kAddShader)) {
        known_[at] = Passing{};
        continue;
      }
      const auto [first, second] = mix->materials;
      const auto &a = known_[static_cast<size_t>(first)], &b = known_[static_cast<size_t>(second)];
      if (!a) open.push_back(first);
      if (!b) open.push_back(second);
      if (!a || !b) continue;
      const bool adds = mix->rule == MixRule::kAddShader;
      const Rgb tint = one_tint(material, a->tint, b->tint);
      const FloatInput amount = mix->amount;
      known_[at] =
          Passing{adds ? added(a->opacity, b->opacity) : mixed(a->opacity, b->opacity, amount), tint};
      if (!adds && depends_on_ray(amount)) known_[at] = without_tint(material, *known_[at]);
    }
  }

  void shapes(std::vector<ShapeDescription>* all) {
    for (ShapeDescription& s : *all) {
      if (s.material < 0 || s.boundary) continue;
      const MaterialDescription& material = scene_.materials[static_cast<size_t>(s.material)];
      const FloatInput& opacity = material.opacity;
      // What shines can be no pane.
      if (is_opaque(opacity) || (is_tinted(material) && s.area_light < 0)) continue;
      if (is_opaque(s.alpha)) {
        s.alpha = opacity;
      } else if (s.alpha.texture < 0 && opacity.texture < 0) {
        s.alpha.value *= opacity.value;
      } else {
        s.alpha = texture(ScaleTexture{grey(s.alpha), opacity});
      }
    }
  }

  SceneDescription& scene_;
  ProblemList& problems_;
  std::vector<std::optional<Passing>> known_;
  bool any_ = false;
};

}  // namespace

void cut_out_transparent(SceneDescription* scene, ProblemList* problems) { CutOuts(scene, problems).run(); }

}  // namespace lightmill
