#pragma once
// Shapes that pbrt-v3 has and v4 has not, as meshes: cone, paraboloid, hyperboloid, heightfield.
#include <optional>
#include <string>

#include "common/scene/pbrt/shapes/quadrics.h"

namespace lightmill::v3 {

bool is_shape(const std::string& type);
/// nullopt: it is left out (reported).
std::optional<ReadShape> read_shape(const std::string& type, PbrtScene& out, ParameterList& params);

}  // namespace lightmill::v3
