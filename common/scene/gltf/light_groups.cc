#include "common/scene/gltf/light_groups.h"

#include <utility>

#include "common/scene/lights/light_group_name.h"

namespace lightmill {

std::optional<std::string> gltf_light_group(const GltfValue& owner) {
  // Extras may be anything, and the rest of them is not ours to speak of.
  const auto any = owner.silent().find("extras");
  if (!any || !any->is_object()) return std::nullopt;
  const auto given = owner.require("extras").find("lightgroup");
  if (!given) return std::nullopt;
  if (!given->is_string()) {
    given->mended("should be a string; it is left out");
    return std::nullopt;
  }
  LightGroupName group = light_group_name(given->text());
  if (!group.change.empty()) given->mended(group.change);
  return std::move(group.name);
}

}  // namespace lightmill
