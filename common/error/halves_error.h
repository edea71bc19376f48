#pragma once
// The error of one picture, from two halves of its samples.
#include "common/image/image.h"

namespace lightmill {

/// Estimate of the picture's relMSE (Metrics::relmse). `difference` is the AOV of this name
/// (common/job/aovs.h), whose square is an unbiased estimate of the squared error; error_weights.h has the
/// denominators. Both have three channels and one size. Pixels that are NaN or infinite in either are left
/// out; 0 if there are no others.
///
/// With noise of a tenth of the light the estimate is within a few percent, with as much noise as light 20 %
/// too low, and with light in rare events anything from 0.6 to 1.5 times the truth.
double relmse_of_halves(const Image& image, const Image& difference);

}  // namespace lightmill
