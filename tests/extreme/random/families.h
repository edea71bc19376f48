#pragma once
// Families of random scenes, one function each. A number out of the same generator twice gives the same
// scene.
#include "tests/extreme/random/draw.h"

namespace lightmill::test {

// enclosures.cc
RandomScene closed_emitter(Draw& d);  // Le (1 - rho^(n + 1)) / (1 - rho) inside any closed shape
RandomScene emitting_bowl(Draw& d);   // the same with rho A / 4 pi R^2 on a part of a sphere
RandomScene convex_in_sky(Draw& d);   // Le + rho L on any convex shape
RandomScene glass_in_sky(Draw& d);    // L through any blocks that absorb nothing, apart or touching
// lamps.cc
RandomScene point_over_floor(Draw& d);   // I h / r^3
RandomScene spot_over_floor(Draw& d);    // the same within the cone, times its smoothstep
RandomScene sphere_over_floor(Draw& d);  // pi L (R / r)^2 cos
RandomScene sun_over_floor(Draw& d);     // E cos
// media.cc
RandomScene slabs(Draw& d);             // absorbing and emitting slabs, apart or touching
RandomScene nested_boxes(Draw& d);      // a medium in a medium, that may share faces
RandomScene furnace_of_media(Draw& d);  // L in media that scatter alone

/// Adds a lamp that nothing lets out, far brighter or fainter than what is seen.
void hide_lamp(Draw& d, const Vec3d& at, double size, RandomScene* scene);

}  // namespace lightmill::test
