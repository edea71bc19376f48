#include "common/scene/lights/scene_light_groups.h"

#include <algorithm>

#include "common/scene/medium_description.h"

namespace lightmill {
namespace {

bool shines(const Rgb& rgb) { return rgb.r != 0 || rgb.g != 0 || rgb.b != 0; }

}  // namespace

LightGroups light_groups_of(const SceneDescription& scene, size_t* left_out) {
  LightGroups groups;
  bool rest = false;
  const auto take = [&](const std::string& name, bool lit) {
    if (!name.empty() && name != kRestGroup) {
      if (std::find(groups.begin(), groups.end(), name) == groups.end()) groups.push_back(name);
    } else {
      rest = rest || lit;
    }
  };
  for (const LightDescription& light : scene.lights) take(light.light_group, true);
  for (const AreaLightDescription& light : scene.area_lights) take(light.light_group, shines(light.radiance));
  for (const MediumDescription& medium : scene.media) take(medium.light_group, shines(medium.emission));
  constexpr size_t kMostNamed = kMaxLightGroups - 1;
  const size_t too_many = groups.size() > kMostNamed ? groups.size() - kMostNamed : 0;
  if (left_out) *left_out = too_many;
  groups.resize(groups.size() - too_many);
  if (!groups.empty() && (rest || too_many > 0)) groups.emplace_back(kRestGroup);
  return groups;
}

}  // namespace lightmill
