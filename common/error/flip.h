#pragma once
// LDR-FLIP: how visible the difference is when one flips between two images.
//
// Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astroem, Fairchild: "FLIP: A Difference Evaluator for
// Alternating Images", PACM CGIT 3(2), 2020. Section numbers in flip.cc are those of the paper.
#include "common/image/image.h"

namespace lightmill {

/// Mean FLIP difference, in [0, 1], of two linear Rec.709 images of the same size with 3 channels, shown
/// clamped to [0, 1] on an sRGB display at kFlipPixelsPerDegree (0.7 m from a 0.7 m wide 4K monitor).
double flip_mean(const Image& image, const Image& reference);

inline constexpr double kFlipPixelsPerDegree = 67;

}  // namespace lightmill
