#pragma once
// Denoising of a rendered picture, with an estimate of the error that is left.
//
//   DenoiseInput in{width, height, colour, difference};
//   in.features[0] = {albedo, albedo_difference}; ...
//   DenoiseResult out = denoise_picture(in, {.threads = 0});
//
// README.md says how it works.
#include <array>
#include <exception>
#include <optional>
#include <stop_token>
#include <vector>

namespace lightmill {

/// Planes of width x height values, row-major. Values may be NaN or infinite: such a pixel takes its value
/// from those around it.
struct DenoiseInput {
  int width = 0, height = 0;
  std::array<std::vector<float>, 3> colour;
  /// Of halves of the samples, scaled as the AOV `difference` is (common/job/aovs.h): its square is an
  /// unbiased estimate of the square of the colour's error.
  std::array<std::vector<float>, 3> difference;
  struct Feature {
    std::vector<float> values, difference;  // either may be empty: unknown, or without noise
  };
  std::array<Feature, 3> albedo, normal;
  Feature depth;
};

struct DenoiseOptions {
  int threads = 0;  // 0: one per processor
  std::stop_token
      stop{};  // asked to stop, denoise_picture() throws DenoiseStopped within a fraction of a second
  /// Filters the picture a second time to learn how far its error is to be trusted: twice the time. Wants
  /// halves whose samples are independent, as those of 32 spp and more are, or the interval is too low.
  bool interval = false;
};

class DenoiseStopped : public std::exception {
 public:
  const char* what() const noexcept override { return "denoising was stopped"; }
};

struct DenoiseResult {
  std::array<std::vector<float>, 3> colour;
  std::vector<float> squared_error;   // estimate, mean over channels, smoothed over the pixels around
  double relmse_raw = 0, relmse = 0;  // estimates for the whole picture
  /// The 95 % interval that `relmse` has, if it was asked for, `difference` is given, and the picture has at
  /// least 16 boxes of 16x16 pixels.
  std::optional<double> relmse_low, relmse_high;
};

/// The same bits for any number of threads. Throws std::invalid_argument for planes of other sizes.
DenoiseResult denoise_picture(DenoiseInput input, const DenoiseOptions& options);

}  // namespace lightmill
