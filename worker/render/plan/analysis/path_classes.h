#pragma once
// Which strategies find which light. Paths fall into classes by where they start and by each event on them:
// S, a mirror or smooth glass, where the direction in alone gives the direction out, or D, anything else
// (Heckbert, "Adaptive Radiosity Textures for Bidirectional Ray Tracing", SIGGRAPH 1990).
#include <cstdint>
#include <string>

#include "common/job/strategies.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// A set of classes of paths, a bit each. Paths of up to four events are enough: longer ones have no pair of
/// neighbouring events that these lack.
using PathClasses = uint64_t;

/// The classes of the scene's light paths, of at most `max_depth` events, that one of `strategies` can make.
PathClasses paths_made(const RenderScene& scene, int max_depth, Strategies strategies);

/// The shortest path of `classes`, e.g. "LSDE from lights at a point or far away". Empty if there is none.
std::string shortest_path(PathClasses classes);

}  // namespace lightmill
