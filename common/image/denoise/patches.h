#pragma once
// Non-local means over patches: the filter that sees what no feature shows.
//
// A pixel's value is the mean of the pixels around whose patches are like its own, as far as noise lets one
// tell (Buades, Coll and Morel, "A non-local algorithm for image denoising", 2005; the distance is that of
// Rousselle, Knaus and Zwicker, "Adaptive Rendering with Non-Local Means Filtering", 2012, equation 3, and
// that of features is added as in "Robust Denoising using Feature and Color Information", 2013). Patches tell
// more than single pixels do, so this filter may be its own guide.
#include "common/image/denoise/denoise.h"
#include "common/image/denoise/features.h"
#include "common/image/denoise/planes.h"

namespace lightmill::denoise {

struct PatchOptions {
  int radius = 5;              // of the window, pixels
  int patch_radius = 1;        // of what is compared
  float noise = 0.6f;          // difference of colours at which weights fall, in standard deviations
  float colour_width = 0.01f;  // the same for colours without noise, relative
  float feature_width = 0.5f;  // difference of features at which weights fall
};

/// Filters both halves, each from its own values. `guide`: whose patches are compared, of each half: the
/// halves themselves, or what was made of them with less noise. Throws DenoiseStopped.
Halves patch_means(const Extent& extent, const Features& features, const Halves& halves, const Halves& guide,
                   const PatchOptions& options, const DenoiseOptions& how);

}  // namespace lightmill::denoise
