#include "common/image/denoise/denoise.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <stdexcept>

#include "common/image/denoise/blend.h"
#include "common/image/denoise/cross_validation.h"
#include "common/image/denoise/features.h"
#include "common/image/denoise/fireflies.h"
#include "common/image/denoise/noise.h"
#include "common/image/denoise/patches.h"
#include "common/image/denoise/planes.h"
#include "common/image/denoise/regression.h"
#include "common/image/fill_holes.h"

namespace lightmill {

namespace {

using namespace denoise;

// Squares of the values have to be floats.
constexpr float kLargest = 1e15f;
constexpr int kErrorRadius = 3;  // of the boxes that the error of pixels is a mean of

// The filters, from the smoothest on. Regressions go by features alone, patches also by what is seen:
// shadows, caustics, reflections.
constexpr RegressionOptions kSmooth{.radius = 9, .stride = 4, .feature_width = 0.5f};
constexpr RegressionOptions kSmall{.radius = 2, .stride = 2, .feature_width = 0.7f};
constexpr PatchOptions kLargePatches{.radius = 5, .patch_radius = 3, .noise = 0.6f};
constexpr PatchOptions kSmallPatches{.radius = 5, .patch_radius = 1, .noise = 1.0f};
// What these make of the picture has so little noise that it is the guide of the last.
constexpr PatchOptions kGuidedPatches{.radius = 7, .patch_radius = 2, .noise = 1.5f};

void check_size(const std::vector<float>& plane, size_t pixels, bool may_lack) {
  if (plane.size() != pixels && !(may_lack && plane.empty()))
    throw std::invalid_argument("denoise_picture: a plane of another size than the picture");
}

void check_sizes(const DenoiseInput& input, size_t pixels) {
  if (input.width < 1 || input.height < 1) throw std::invalid_argument("denoise_picture: no pixels");
  for (const auto& plane : input.colour) check_size(plane, pixels, false);
  const bool no_difference = input.difference[0].empty();
  for (const auto& plane : input.difference) check_size(plane, no_difference ? 0 : pixels, false);
  const auto check = [&](const DenoiseInput::Feature& feature) {
    check_size(feature.values, pixels, true);
    check_size(feature.difference, feature.values.size(), true);
  };
  for (const auto& feature : input.albedo) check(feature);
  for (const auto& feature : input.normal) check(feature);
  check(input.depth);
}

/// Gives pixels that have no number the colour of those around them, and no noise.
void mend(DenoiseInput* input) {
  const Extent extent{input->width, input->height};
  std::vector<uint8_t> known(extent.pixels(), 1);
  const auto look = [&](const std::array<std::vector<float>, 3>& planes) {
    for (const std::vector<float>& plane : planes) {
      for (size_t i = 0; i < plane.size(); ++i) known[i] &= static_cast<uint8_t>(std::isfinite(plane[i]));
    }
  };
  look(input->colour);
  look(input->difference);
  if (std::find(known.begin(), known.end(), 0) != known.end()) {
    Image colour(extent.width, extent.height);
    for (size_t i = 0; i < extent.pixels(); ++i) {
      for (size_t c = 0; c < 3; ++c) colour.data[3 * i + c] = known[i] ? input->colour[c][i] : 0;
    }
    fill_holes(known, &colour);
    for (size_t c = 0; c < 3; ++c) {
      for (size_t i = 0; i < extent.pixels(); ++i) {
        if (known[i]) continue;
        input->colour[c][i] = colour.data[3 * i + c];
        if (!input->difference[c].empty()) input->difference[c][i] = 0;
      }
    }
  }
  for (size_t c = 0; c < 3; ++c) {
    for (float& x : input->colour[c]) x = std::clamp(x, -kLargest, kLargest);
    for (float& x : input->difference[c]) x = std::clamp(x, -kLargest, kLargest);
  }
}

Halves halves_of(const DenoiseInput& input) {
  Halves halves(input.colour[0].size());
  for (size_t c = 0; c < 3; ++c) {
    for (size_t i = 0; i < input.colour[c].size(); ++i) {
      halves.of[0].c[c][i] = input.colour[c][i] + input.difference[c][i];
      halves.of[1].c[c][i] = input.colour[c][i] - input.difference[c][i];
    }
  }
  return halves;
}

Features take_features(DenoiseInput* input, const DenoiseOptions& options) {
  const Extent extent{input->width, input->height};
  if (!input->depth.values.empty()) scale_depth(&input->depth.values, &input->depth.difference);
  DenoiseInput::Feature* const from[kFeatures] = {&input->albedo[0], &input->albedo[1], &input->albedo[2],
                                                  &input->normal[0], &input->normal[1], &input->normal[2],
                                                  &input->depth};
  std::array<Plane, kFeatures> values, difference;
  for (size_t k = 0; k < kFeatures; ++k) {
    values[k] = std::move(from[k]->values);
    difference[k] = std::move(from[k]->difference);
    if (values[k].empty()) values[k].assign(extent.pixels(), 0.0f);
    const auto tame = [](Plane* plane) {
      for (float& x : *plane) x = std::isfinite(x) ? std::clamp(x, -8.0f, 8.0f) : 0;
    };
    tame(&values[k]);
    tame(&difference[k]);
  }
  return filter_features(extent, std::move(values), difference, options);
}

/// What the filters made of the halves.
struct Filtered {
  Halves best;
  Halves apart;  // much the same, but of no half has noise of the other had a say: its error can be estimated
};

Filtered filter(const Extent& extent, const Features& features, Halves halves,
                const DenoiseOptions& options) {
  const int threads = options.threads;
  clamp_fireflies(extent, threads, &halves);
  const Halves large = patch_means(extent, features, halves, halves, kLargePatches, options);
  const Halves small = patch_means(extent, features, halves, halves, kSmallPatches, options);
  Halves guide = regress(extent, features, halves, kSmooth, options);
  const auto refine_guide = [&](const Halves& finer) {
    blend_in(extent, halves, finer, BlendSums::kButNear, threads, &guide);
  };
  refine_guide(regress(extent, features, halves, kSmall, options));
  for (const Halves* finer : {&large, &small}) refine_guide(*finer);

  Filtered result{guide, guide};
  const auto refine = [&](const Halves& finer) {
    blend_in(extent, halves, finer, BlendSums::kAll, threads, &result.best);
    blend_in(extent, halves, finer, BlendSums::kButNear, threads, &result.apart);
  };
  refine(patch_means(extent, features, halves, guide, kGuidedPatches, options));
  for (const Halves* finer : std::initializer_list<const Halves*>{&large, &small, &halves}) refine(*finer);
  return result;
}

/// What a filtered half knows of the other (cross_validation.h).
Plane probe(const Extent& extent, const Features& features, const Halves& halves, const Halves& filtered,
            const DenoiseOptions& options) {
  Halves probed = halves;
  probed.of[1] = without_some_pixels(extent, halves.of[1], filtered.of[0]);
  probed = filter(extent, features, std::move(probed), options).apart;
  return knowledge_of_other(extent, halves, filtered, probed.of[0], options.threads);
}

}  // namespace

DenoiseResult denoise_picture(DenoiseInput input, const DenoiseOptions& options) {
  const Extent extent{input.width, input.height};
  const size_t pixels = extent.pixels();
  check_sizes(input, pixels);
  mend(&input);
  const bool measured = !input.difference[0].empty();
  for (unsigned c = 0; c < 3; ++c) {
    if (input.difference[c].empty())
      input.difference[c] = guess_difference(extent, input.colour[c], c, options.threads);
  }

  DenoiseResult result;
  const Features features = take_features(&input, options);
  const Filtered filtered = filter(extent, features, halves_of(input), options);
  const Halves halves = halves_of(input);  // once more: filters need much memory
  ErrorPlanes error = estimate_error(extent, halves, filtered.apart, options.threads);
  const Plane known =
      options.interval && measured ? probe(extent, features, halves, filtered.apart, options) : Plane();
  const RelmseEstimate estimate = estimate_relmse(extent, error, known);
  result.relmse = estimate.relmse, result.relmse_low = estimate.low, result.relmse_high = estimate.high;
  // What noise is left for certain: no estimate may be below it. With up to 16 spp the halves make up for
  // each other's errors, and the residuals' covariance is then too low.
  Plane noise(pixels);
  double sum_raw = 0;
  for (size_t c = 0; c < 3; ++c) {
    result.colour[c].resize(pixels);
    for (size_t i = 0; i < pixels; ++i) {
      result.colour[c][i] = 0.5f * (filtered.best.of[0].c[c][i] + filtered.best.of[1].c[c][i]);
      const double mean = result.colour[c][i], difference = input.difference[c][i];
      const float left = 0.5f * (filtered.best.of[0].c[c][i] - filtered.best.of[1].c[c][i]);
      noise[i] += left * left * (1.0f / 3);
      sum_raw += difference * difference / (mean * mean + double{kRelativeFloor});
    }
  }
  result.relmse_raw = sum_raw / static_cast<double>(3 * pixels);
  box_mean(extent, kErrorRadius, options.threads, &error.squared);
  box_mean(extent, kErrorRadius, options.threads, &noise);
  for (size_t i = 0; i < pixels; ++i) error.squared[i] = std::max(error.squared[i], noise[i]);
  result.squared_error = std::move(error.squared);
  return result;
}

}  // namespace lightmill
