#pragma once
// Light groups in glTF files: the string `extras.lightgroup`, which is ours.
#include <optional>
#include <string>

#include "common/scene/gltf/json/json.h"

namespace lightmill {

/// The group that a light, a material or a node names; "" says that it has none. Nothing if it does not say,
/// or (mended) by no string.
std::optional<std::string> gltf_light_group(const GltfValue& owner);

}  // namespace lightmill
