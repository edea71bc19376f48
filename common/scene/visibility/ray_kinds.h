#pragma once
// Kinds of rays, by which shapes and lights can be hidden ("hidden" in scene files): Cycles' ray visibility.
//
// A path's segment next to the camera is a camera ray, whichever strategy made it: nothing that is hidden
// from the camera is at either end of it or on its way. A segment that joins two vertices is a shadow ray.
// Any other has the kind of the scattering that sends light along it to the camera; one that goes straight
// on, as through a pane, keeps its kind. In a medium a ray is of two kinds: it sees what either sees.
#include <cstdint>

namespace lightmill {

using RayKinds = uint8_t;  // a set of them
inline constexpr RayKinds kCameraRays = 1, kDiffuseRays = 2, kGlossyRays = 4, kTransmissionRays = 8,
                          kVolumeRays = 16, kShadowRays = 32;
inline constexpr RayKinds kScatteredRays = kDiffuseRays | kGlossyRays | kTransmissionRays | kVolumeRays;
inline constexpr RayKinds kAllRays = kCameraRays | kScatteredRays | kShadowRays;

/// Beside a ray's kinds: a mirror or smooth glass sent it. Nothing is hidden from such rays as such.
inline constexpr RayKinds kSharpRays = 64;

/// Whether a ray of `kinds`, not empty, does not see what is `hidden` from some.
constexpr bool is_hidden(RayKinds hidden, RayKinds kinds) { return (kinds & kAllRays & ~hidden) == 0; }

}  // namespace lightmill
