#pragma once
// Image metrics against a reference.
#include <array>
#include <optional>

#include "common/error/error_curve.h"
#include "common/image/image.h"

namespace lightmill {

struct Metrics {
  double mse = 0;             // mean over pixels and channels
  double relmse = 0;          // mean((I-R)^2 / (R^2 + 1e-2))
  double relmse_trimmed = 0;  // without the 0.1 % of pixels of largest error
  double mae = 0;
  double flip = 0;        // LDR-FLIP mean, after sRGB tone curve; Andersson et al. 2020
  double mean_ratio = 1;  // mean(I) / mean(R) over pixels and channels
  std::array<std::optional<double>, kBoxSides.size()> relmse_of_boxes;  // BoxError::true_relmse
};

/// `mean_ratio` is infinite if only the reference is black. Throws Error(kUsage) if the sizes differ and
/// Error(kFailed) if either has a non-finite value.
Metrics compare_images(const Image& image, const Image& reference);

/// Checks what compare_images needs of an image, for use before a long render: RGB pixels, all finite. Throws
/// Error(kFailed) that calls the image `which`.
void check_comparable(const Image& image, const char* which);

}  // namespace lightmill
