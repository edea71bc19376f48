#pragma once
// The noise of a picture of which no halves are known.
#include "common/image/denoise/planes.h"

namespace lightmill::denoise {

/// A plane to stand for the AOV `difference`: normal numbers of the variance that the picture's own finest
/// detail has around each pixel. If noise has that variance, is normal, and that of neighbours is
/// independent, then picture + difference and picture - difference have independent errors, as halves have
/// (Pang et al., "Recorrupted-to-Recorrupted: Unsupervised Deep Learning for Image Denoising", 2021). The
/// variance is that of a Laplacian (Immerkaer, "Fast Noise Variance Estimation", 1996); texture counts as
/// noise, so this is a guess. `stream`: another one for each channel.
Plane guess_difference(const Extent& extent, const Plane& channel, unsigned stream, int threads);

}  // namespace lightmill::denoise
