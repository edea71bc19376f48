#pragma once
// Alpha masks: surfaces that stop only a part of the rays.
//
// A crossing is decided by comparing alpha with a hash of the ray's bits and the primitive, as pbrt-v4 does.
// That is a pure function: no random number is drawn and no state is kept. Every ray that meets a surface of
// alpha a is stopped with probability a, whatever kind of ray it is. So the vertices of a path carry the
// factor with which its segments are let through, in every strategy alike, and MIS weights need not know of
// it. A hash of the position alone would make a mask that stays: neighbouring rays through the same point
// would agree, and what next-event and BSDF rays find there would be correlated.
//
// Of the segments of paths a number of their sample stream decides instead, where it can (alpha_walk.h).
#include "common/scene/description.h"
#include "worker/render/math/vec.h"

namespace lightmill {

struct RenderScene;

/// Alpha where ray (o, d), which is known to hit triangle `prim` of a mesh with `alpha`, in `instance` (-1:
/// in none) at `time`, meets it. The ray is in the triangle's space. `shadow`: it asks whether a light is
/// seen, for textures that make a difference of that.
float alpha_at(const RenderScene& scene, const FloatInput& alpha, int32_t prim, int32_t instance, float time,
               const Vec3<float>& o, const Vec3<float>& d, bool shadow = false);

/// Whether a surface of alpha `a` stops this ray.
bool alpha_stops(float a, int32_t prim, int32_t instance, const Vec3<float>& o, const Vec3<float>& d);

/// Whether rays may pass.
inline bool has_alpha_mask(const FloatInput& alpha) { return alpha.texture >= 0 || alpha.value < 1; }

/// Whether direction `d` meets triangle `prim` from behind. `outwards`: as in MeshRange::fibres.
bool meets_back(const RenderScene& scene, int32_t prim, int32_t outwards, const Vec3<float>& d);

}  // namespace lightmill
