#pragma once
// The error of a filtered picture, by cross-validation between its halves (derivation: cross_validation.cc).
#include <optional>
#include <vector>

#include "common/image/denoise/planes.h"

namespace lightmill::denoise {

/// Estimates, per pixel and not smoothed, so they may be negative. Means over channels.
struct ErrorPlanes {
  Plane noise;     // half the halves' difference, squared, over that; the raw picture's share
  Plane squared;   // of the squared error
  Plane relative;  // of that over the square of the value + 1e-2: a pixel's share of relMSE
  std::vector<double>
      smooth_bias;  // sums over boxes of 16x16 pixels of the part of `relative` that is a bias alike
                    // in the whole box; at most the part that is a bias of pixels, but for noise
  Plane spread;     // the part of `relative` that is known for certain: how much the filtered halves differ
};

/// Of (F_A + F_B) / 2, where F is what a filter made of each half. Without bias, as far as F_A does not know
/// B.
ErrorPlanes estimate_error(const Extent& extent, const Halves& halves, const Halves& filtered, int threads);

/// Half B without a quarter of its pixels, in whose place are those of `instead`.
Colour without_some_pixels(const Extent& extent, const Colour& half, const Colour& instead);

/// What F_A knows of B, as a share of relMSE, per pixel (only where pixels were left out, for all others,
/// too): twice the mean product of B's noise and F_A's error. `probed`: F_A of halves whose B is
/// without_some_pixels(B, F_A).
Plane knowledge_of_other(const Extent& extent, const Halves& halves, const Halves& filtered,
                         const Colour& probed, int threads);

struct RelmseEstimate {
  double relmse = 0;
  std::optional<double> low,
      high;  // the 95 % interval of this picture's error; from 16 boxes of 16x16 pixels on
};

/// Of the whole picture. `known`: knowledge_of_other(); empty: none is taken into account, and there is no
/// interval.
RelmseEstimate estimate_relmse(const Extent& extent, const ErrorPlanes& error, const Plane& known);

}  // namespace lightmill::denoise
