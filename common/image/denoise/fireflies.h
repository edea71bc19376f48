#pragma once
// Fireflies: light that one half of the samples has found and the other has not.
#include "common/image/denoise/planes.h"

namespace lightmill::denoise {

/// Scales a pixel of one half down to somewhat above the brightest of the pixels around it in the other half.
/// What is bright in both (a caustic, a lamp) stays.
void clamp_fireflies(const Extent& extent, int threads, Halves* halves);

}  // namespace lightmill::denoise
