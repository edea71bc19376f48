#include "common/error/metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/error.h"
#include "common/error/error_weights.h"
#include "common/error/flip.h"
#include "common/image/box_means.h"

namespace lightmill {

namespace {

constexpr size_t kTrimOneIn = 1000;  // the trimmed relMSE leaves out 0.1 % of the pixels

/// One of Metrics::relmse_of_boxes.
std::optional<double> compare_boxes(const Image& image, const Image& reference, int side) {
  const Image means = box_means(image, side), truth = box_means(reference, side);
  if (means.data.empty()) return std::nullopt;
  double sum = 0;
  for (size_t i = 0; i < means.data.size(); ++i) {
    const double r = truth.data[i], d = means.data[i] - r;
    sum += d * d / (r * r + kRelMseEpsilon);
  }
  return sum / static_cast<double>(means.data.size()) * side * side;
}

}  // namespace

void check_comparable(const Image& image, const char* which) {
  const auto complain = [&](const std::string& why) {
    throw Error(ErrorKind::kFailed, std::string("can't compare: the ") + which + " " + why);
  };
  if (image.channels != 3 || image.width < 1 || image.height < 1) complain("has no RGB pixels");
  for (size_t i = 0; i < image.data.size(); ++i) {
    if (std::isfinite(image.data[i])) continue;
    const size_t pixel = i / 3, width = static_cast<size_t>(image.width);
    complain("has a non-finite value at pixel (" + std::to_string(pixel % width) + ", " +
             std::to_string(pixel / width) + ")");
  }
}

Metrics compare_images(const Image& image, const Image& reference) {
  if (image.width != reference.width || image.height != reference.height) {
    throw Error(ErrorKind::kUsage, "can't compare images of different sizes: " + std::to_string(image.width) +
                                       "x" + std::to_string(image.height) + " and " +
                                       std::to_string(reference.width) + "x" +
                                       std::to_string(reference.height));
  }
  check_comparable(image, "image");
  check_comparable(reference, "reference");

  const size_t pixels = image.data.size() / 3;
  const auto values = static_cast<double>(image.data.size());
  Metrics m;
  double sum_image = 0, sum_reference = 0;
  std::vector<double> pixel_error(pixels, 0.0);  // relMSE of a pixel, summed over channels
  for (size_t i = 0; i < image.data.size(); ++i) {
    const double v = image.data[i], r = reference.data[i], d = v - r;
    m.mse += d * d;
    m.mae += std::fabs(d);
    pixel_error[i / 3] += d * d / (r * r + kRelMseEpsilon);
    sum_image += v;
    sum_reference += r;
  }
  m.mse /= values;
  m.mae /= values;
  if (sum_image != sum_reference) {
    m.mean_ratio = sum_reference != 0 ? sum_image / sum_reference : std::numeric_limits<double>::infinity();
  }
  for (const double e : pixel_error) m.relmse += e / values;
  const size_t kept = pixels - pixels / kTrimOneIn;
  std::nth_element(pixel_error.begin(), pixel_error.begin() + static_cast<std::ptrdiff_t>(kept - 1),
                   pixel_error.end());
  for (size_t i = 0; i < kept; ++i) m.relmse_trimmed += pixel_error[i] / static_cast<double>(3 * kept);
  m.flip = flip_mean(image, reference);
  for (size_t i = 0; i < kBoxSides.size(); ++i)
    m.relmse_of_boxes[i] = compare_boxes(image, reference, kBoxSides[i]);
  return m;
}

}  // namespace lightmill
