#pragma once
// What a camera gives to the kernels, in both directions.
//
// Each camera of camera.h has
//   static constexpr bool kHasLens;    // ray() and connect() use their lens sample; else it is not drawn
//   static constexpr bool kParallel;   // directions are fixed and positions are sampled
//   static constexpr bool kWeighted;   // rays have weights; where that is 0 there is none
//   CameraRay<F> ray(F x, F y, F lens_u, F lens_v) const;
//   LensConnection<F> connect(const Vec3<F>& p, F lens_u, F lens_v) const;
// Raster coordinates are continuous pixels: pixel (x, y) covers [x, x+1) x [y, y+1), y down.
// The response is 1 for a uniform position on the raster and, with a lens, on the lens: a pixel
// is the mean radiance over both.
#include "worker/render/math/vec.h"

namespace lightmill {

/// The ray through a raster position.
template <class F>
struct CameraRay {
  Vec3<F> origin, direction;  // normalised space; unit
  F density;                  // raster area (pixels) per unit solid angle; kParallel: per unit area across
  F weight{};                 // kWeighted: of its radiance; 0: no ray
};

/// A point of the scene joined to the lens.
template <class F>
struct LensConnection {
  Vec3<F> lens;       // the point of the lens, normalised space
  Vec3<F> direction;  // unit, from the point to the lens
  F x, y;             // raster position
  F density;          // raster area (pixels) per unit area across `direction` at the point
  MaskOf<F> seen;     // in front of the camera; nothing else is meant where this is false
};

}  // namespace lightmill
