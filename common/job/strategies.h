#pragma once
// Families of the (s,t) strategies: paths of s light and t camera vertices. Any set is a render of its own,
// with weights that sum to one over the set. Paths that no member can make are missing from the image.
// Emitters themselves are visible only with `hit` or `light-tracing` in the set.
#include <string>

namespace lightmill {

/// A set of families: their sum.
using Strategies = unsigned;
inline constexpr Strategies kEmissionHits = 1;       // s = 0: a camera path hits an emitter or escapes
inline constexpr Strategies kNextEvent = 2;          // s = 1, t >= 2
inline constexpr Strategies kLightTracing = 4;       // t = 1
inline constexpr Strategies kVertexConnections = 8;  // s >= 2, t >= 2
inline constexpr Strategies kAllStrategies = 15;
inline constexpr Strategies kCameraLayer = kEmissionHits | kNextEvent | kVertexConnections;
inline constexpr Strategies kLightPaths = kLightTracing | kVertexConnections;

/// "hit,next-event,light-tracing,vertex-connection", those in the set.
std::string strategy_names(Strategies set);
/// Inverse; throws Error(kUsage) on an unknown name or an empty set.
Strategies strategies_named(const std::string& names);

}  // namespace lightmill
