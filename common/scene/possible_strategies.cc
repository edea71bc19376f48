#include "common/scene/possible_strategies.h"

#include <algorithm>

#include "common/scene/parts_in_use.h"
#include "common/scene/texture_graph/texture_graph.h"

namespace lightmill {
namespace {

bool any_flat_tube(const std::vector<ShapeDescription>& shapes) {
  return std::any_of(shapes.begin(), shapes.end(), [](const ShapeDescription& shape) {
    const auto* mesh = std::get_if<MeshShape>(&shape.kind);
    return mesh && mesh->mesh->tube && mesh->mesh->flat;
  });
}

/// Whether a texture in use asks for the ray that meets it.
bool any_of_ray(const SceneDescription& scene) {
  const PartsInUse parts = parts_in_use(scene);
  for (size_t i = 0; i < scene.textures.size(); ++i) {
    const auto* graph = std::get_if<GraphTexture>(&scene.textures[i].kind);
    if (parts.textures[i] && graph && reads_ray(*graph->graph)) return true;
  }
  return false;
}

bool any_hair(const SceneDescription& scene) {
  const PartsInUse parts = parts_in_use(scene);
  for (size_t i = 0; i < scene.materials.size(); ++i) {
    if (parts.materials[i] && std::holds_alternative<HairMaterial>(scene.materials[i].kind)) return true;
  }
  return false;
}

bool any_blender_bump(const SceneDescription& scene) {
  const PartsInUse parts = parts_in_use(scene);
  for (size_t i = 0; i < scene.materials.size(); ++i) {
    if (parts.materials[i] && scene.materials[i].bump_by_pixel && scene.materials[i].displacement >= 0)
      return true;
  }
  return false;
}

/// Whether something is hidden from rays that are not the camera's, other than a light that only the camera
/// sees.
bool hides_from_others(const SceneDescription& scene) {
  constexpr RayKinds kOthers = kScatteredRays | kShadowRays;
  const auto hides = [](const auto& thing) { return (thing.hidden & kOthers) != 0; };
  return std::ranges::any_of(scene.shapes, hides) || std::ranges::any_of(scene.instances, hides) ||
         std::ranges::any_of(
             scene.objects,
             [&](const ObjectDescription& o) { return std::ranges::any_of(o.shapes, hides); }) ||
         std::ranges::any_of(scene.lights, [](const LightDescription& light) {
           const RayKinds scattered = light.hidden & kScatteredRays;
           return scattered != 0 && scattered != kScatteredRays;
         });
}

}  // namespace

PossibleStrategies possible_strategies(const SceneDescription& scene) {
  const bool flat = any_flat_tube(scene.shapes) ||
                    std::any_of(scene.objects.begin(), scene.objects.end(),
                                [](const ObjectDescription& object) { return any_flat_tube(object.shapes); });
  if (flat || any_hair(scene))
    return {kAllStrategies & ~kLightPaths, "hair and flat curves are seen by camera paths alone"};
  if (hides_from_others(scene))
    return {kAllStrategies & ~kLightPaths,
            "what is \"hidden\" from other rays than the camera's is right by camera paths alone"};
  if (any_of_ray(scene))
    return {kAllStrategies & ~kLightPaths,
            "a texture depends on the ray that meets it (Fresnel, Layer Weight, Light Path, Incoming, "
            "Backfacing, Reflection), which camera paths alone know"};
  if (any_blender_bump(scene))
    return {kAllStrategies & ~kLightPaths,
            "a bump of Blender's turns to whoever looks at it, whom camera paths alone know"};
  if (scene.camera.kind == CameraKind::kRealistic)
    return {kAllStrategies & ~kLightTracing, "a realistic camera can't be joined to light paths"};
  return {};
}

}  // namespace lightmill
