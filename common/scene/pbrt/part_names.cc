// "object", "asset" and "materialname": what Cryptomatte calls a shape or an instance, and the material of a
// shape; "objectid" and "materialid", their numbers. Ours; pbrt has no such thing.
#include "common/scene/pbrt/scene.h"

namespace lightmill {

PartNames part_names_from(ParameterList& params, SceneDescription* scene) {
  const auto number = [&](const char* parameter) {
    const std::string name = params.text(parameter, "");
    return name.empty() ? -1 : scene->names.number(name);
  };
  PartNames names;
  names.object = number("object");
  names.asset = number("asset");
  names.material = number("materialname");
  const auto id = [&](const char* parameter) {
    return static_cast<int>(params.integer(parameter, -1, 0, kMaxGivenId));
  };
  names.object_id = id("objectid");
  names.material_id = id("materialid");
  return names;
}

}  // namespace lightmill
