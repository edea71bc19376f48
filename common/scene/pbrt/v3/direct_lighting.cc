#include "common/scene/pbrt/v3/direct_lighting.h"

#include <algorithm>

namespace lightmill::v3 {
namespace {

bool is_smooth(const Roughness& r) {
  return r.u.texture < 0 && r.v.texture < 0 && r.u.value == 0 && r.v.value == 0;
}

bool is_specular(const SceneDescription& scene, const MaterialDescription& material) {
  const MaterialKind& kind = material.kind;
  if (const auto* mix = std::get_if<MixMaterial>(&kind)) {
    return std::ranges::any_of(mix->materials, [&](int i) {
      const MaterialDescription& part = scene.materials.at(static_cast<size_t>(i));
      return !std::holds_alternative<MixMaterial>(part.kind) && is_specular(scene, part);
    });
  }
  if (const auto* m = std::get_if<ConductorMaterial>(&kind)) return is_smooth(m->roughness);
  if (const auto* m = std::get_if<DielectricMaterial>(&kind)) return is_smooth(m->roughness);
  if (const auto* m = std::get_if<CoatedDiffuseMaterial>(&kind)) return is_smooth(m->roughness);
  return std::holds_alternative<ThinDielectricMaterial>(kind);
}

}  // namespace

bool is_direct_lighting(const std::string& integrator) {
  return integrator == "directlighting" || integrator == "whitted";
}

void choose_depth(const SourceLocation& where, SceneDescription* scene, ProblemList* problems) {
  const auto seen = [&](const ShapeDescription& s) {
    return is_specular(*scene, scene->materials.at(static_cast<size_t>(s.material)));
  };
  const bool specular =
      std::ranges::any_of(scene->shapes, seen) ||
      std::ranges::any_of(scene->objects, [&](const auto& o) { return std::ranges::any_of(o.shapes, seen); });
  int& depth = scene->sampling.max_depth;
  if (!specular) depth = std::min(depth, 1);
  problems->warning(
      where, "an integrator of direct light is read as \"path\" of \"maxdepth\" " + std::to_string(depth) +
                 (specular ? ", for the sake of mirrors and glass; surfaces light each other, too"
                           : ", as by pbrt-v4's --upgrade") +
                 "; --max-depth sets another");
}

}  // namespace lightmill::v3
