#pragma once
// Graphs that are the same everywhere.
#include <optional>

#include "common/scene/description.h"

namespace lightmill {

/// The scene with constants in place of such graphs, simplified by them; nothing if there is none.
std::optional<SceneDescription> with_constant_graphs(const SceneDescription& scene);

}  // namespace lightmill
