// "object" and "asset": what Cryptomatte calls a shape or an instance. Ours; pbrt has no such thing.
#include "common/scene/pbrt/scene.h"

namespace lightmill {

PartNames part_names_from(ParameterList& params, SceneDescription* scene) {
  const auto number = [&](const char* parameter) {
    const std::string name = params.text(parameter, "");
    return name.empty() ? -1 : scene->names.number(name);
  };
  const int object = number("object");
  return {object, number("asset")};
}

}  // namespace lightmill
