#pragma once
// The error of a filtered picture, by cross-validation between its halves (derivation: cross_validation.cc).
#include <optional>

#include "common/image/denoise/planes.h"

namespace lightmill::denoise {

/// Estimates, per pixel and not smoothed, so they may be negative. Means over channels.
struct ErrorPlanes {
  Plane squared;   // of the squared error
  Plane relative;  // of that over the square of the value + 1e-2: a pixel's share of relMSE
  Plane spread;    // the part of `relative` that is known for certain: how much the filtered halves differ
};

/// Of (F_A + F_B) / 2, where F is what a filter made of each half. Without bias, as far as F_A does not know
/// B.
ErrorPlanes estimate_error(const Extent& extent, const Halves& halves, const Halves& filtered, int threads);

/// Noise like that of half B, of half its size and independent of it: made of differences of the halves from
/// elsewhere nearby.
Colour noise_like_a_half(const Extent& extent, const Halves& halves, int threads);

/// What F_A knows of B, as a share of relMSE, per pixel: twice the mean product of B's noise and F_A's error.
/// `filtered`: F_A. `probed`: what F_A becomes when `noise` is added to B.
Plane knowledge_of_other(const Extent& extent, const Halves& filtered, const Colour& probed,
                         const Colour& noise, int threads);

struct RelmseEstimate {
  double relmse = 0;
  std::optional<double> low,
      high;  // the 95 % interval of this picture's error; from 16 boxes of 16x16 pixels on
};

/// Of the whole picture. `known`: knowledge_of_other(); empty: none is taken into account, and there is no
/// interval.
RelmseEstimate estimate_relmse(const Extent& extent, const ErrorPlanes& error, const Plane& known);

}  // namespace lightmill::denoise
