#pragma once
// Closed and open shapes around the origin whose points see each other.
#include <string>

#include "tests/support/test_scene.h"

namespace lightmill::test {

enum class Solid { kSphere, kBox, kBipyramid, kBall, kCylinder, kCone };
inline constexpr int kSolids = 6;
const char* solid_name(Solid solid);

/// Adds a convex shape as one mesh, or a sphere; curved ones have `rings` facets from end to end. Returns the
/// radius of a sphere around the origin that is well within it.
double add_solid(TestScene* s, Solid solid, int rings, int material, const Emits& emits);
/// The part of the unit sphere with z <= `top` (-1 to 1), as a mesh of `rings` rings, its outside outwards.
void add_bowl(TestScene* s, double top, int rings, int material, const Emits& emits);

}  // namespace lightmill::test
