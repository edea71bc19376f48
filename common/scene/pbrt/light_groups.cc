// "lightgroup": the group of a light, of surfaces that emit, or of a medium that shines. Ours; pbrt has no
// such thing.
#include "common/scene/lights/light_group_name.h"
#include "common/scene/pbrt/scene.h"

namespace lightmill {

std::string light_group_from(ParameterList& params) {
  LightGroupName group = light_group_name(params.text("lightgroup", ""));
  if (!group.change.empty()) params.problems().warning(params.where_of("lightgroup"), group.change);
  return std::move(group.name);
}

}  // namespace lightmill
