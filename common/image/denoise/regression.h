#pragma once
// Weighted local linear regression on features: the filter that all others are made of.
//
// Around every centre a model of the colour is fitted that is linear in the features, with weights that say
// which pixels are like the centre. The model predicts the colours of all those pixels, and a pixel's value
// is the mean of what the models around it predict, by the same weights (Moon et al., "Adaptive Rendering
// based on Weighted Local Regression", 2014; Bitterli et al., "Nonlinearly Weighted First-order Regression
// for Denoising Monte Carlo Renderings", 2016).
#include "common/image/denoise/denoise.h"
#include "common/image/denoise/features.h"
#include "common/image/denoise/planes.h"

namespace lightmill::denoise {

struct RegressionOptions {
  int radius = 9;              // of the window, pixels
  int stride = 3;              // centres are every so many pixels on both axes
  float feature_width = 0.3f;  // difference of features at which weights fall
  float ridge = 1e-4f;         // least variance of a feature for which the model uses it
};

/// Filters both halves, each from its own values. Throws DenoiseStopped.
Halves regress(const Extent& extent, const Features& features, const Halves& halves,
               const RegressionOptions& options, const DenoiseOptions& how);

}  // namespace lightmill::denoise
