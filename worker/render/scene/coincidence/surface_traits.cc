#include "worker/render/scene/coincidence/surface_traits.h"

#include "worker/render/scene/geometry/alpha_mask.h"

namespace lightmill {
namespace {

constexpr int kDeepestMix = 8;  // beyond it is taken for opaque

bool passes_light(const SceneDescription& scene, int material, int depth) {
  if (material < 0 || depth > kDeepestMix) return false;
  const MaterialKind& kind = scene.materials[static_cast<size_t>(material)].kind;
  if (const auto* mix = std::get_if<MixMaterial>(&kind)) {
    return passes_light(scene, mix->materials[0], depth + 1) ||
           passes_light(scene, mix->materials[1], depth + 1);
  }
  if (const auto* m = std::get_if<PrincipledMaterial>(&kind))
    return m->part == PrincipledMaterial::Part::kGlass;
  if (const auto* m = std::get_if<ClosureMaterial>(&kind)) {
    return m->closure == ClosureKind::kGlass || m->closure == ClosureKind::kRefraction ||
           m->closure == ClosureKind::kTranslucent || m->closure == ClosureKind::kTransparent;
  }
  return std::holds_alternative<DielectricMaterial>(kind) ||
         std::holds_alternative<ThinDielectricMaterial>(kind) ||
         std::holds_alternative<DiffuseTransmissionMaterial>(kind) ||
         std::holds_alternative<TransmissionMaterial>(kind) ||
         std::holds_alternative<SubsurfaceMaterial>(kind);
}

}  // namespace

SurfaceTraits surface_traits(const SceneDescription& scene, const ShapeDescription& shape) {
  SurfaceTraits t;
  t.masked = has_alpha_mask(shape.alpha);
  t.passes = shape.boundary || t.masked || passes_light(scene, shape.material, 0);
  t.emits = shape.area_light >= 0;
  t.one_sided = t.emits && !scene.area_lights[static_cast<size_t>(shape.area_light)].two_sided;
  t.flipped = surface_flips_normal(shape);
  t.material = shape.boundary ? -1 : shape.material;
  t.boundary = shape.boundary;
  t.media = shape.media;
  t.location = shape.location;
  return t;
}

}  // namespace lightmill
