#pragma once
// Which strategies find which light. Paths fall into classes by where they start and by what each event on
// them is: S, a mirror or smooth glass, where only the way on itself leads there and back, or D, anything
// else (Heckbert, "Adaptive Radiosity Textures for Bidirectional Ray Tracing", SIGGRAPH 1990).
#include <cstdint>
#include <string>

#include "common/job/strategies.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// A set of classes of paths of up to four events, a bit each: longer ones have no pair of neighbours that
/// these lack.
using PathClasses = uint64_t;

/// Those of the scene's light paths of at most `max_depth` events that some of `strategies` makes.
PathClasses paths_made(const RenderScene& scene, int max_depth, Strategies strategies);

/// The shortest of `classes`, e.g. "LSDE from a light at a point or far away". Empty if there is none.
std::string shortest_path(PathClasses classes);

}  // namespace lightmill
