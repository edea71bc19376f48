#pragma once
// Error against run time: the curve of a job, and the batch images that its estimate rests on.
//
// Estimate. relMSE = mean((I-R)^2 / (R^2 + 1e-2)) over pixels and channels. Superblocks (16 samples, camera
// and splat layers together) are grouped into 16..31 batches of equally many superblocks (pairs of
// neighbours are merged when 32 are full). The error of the mean of n batches is estimated from each
// batch's image-level squared deviation, corrected for the noise in its own denominator; the interval is
// Student's t over those n image-level values, never over pixels. With fewer than 16 complete superblocks
// the same is done with those there are (>= 2) and the point says how many `batches` it rests on.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/image/image.h"
#include "common/image/partial.h"

namespace lightmill {

struct ErrorPoint {
  double wall_seconds = 0;
  double cpu_seconds = 0;
  double spp = 0;
  std::optional<double> relmse, relmse_low, relmse_high;  // estimated, 95 %
  int batches = 0;
  // Only with a reference image:
  std::optional<double> true_relmse, true_relmse_trimmed, true_flip;
};

struct ErrorCurve {
  std::string job_name;
  std::vector<ErrorPoint> points;
};

/// JSON, the form that is stored and sent. curve_from_json throws Error(kFailed).
std::string curve_to_json(const ErrorCurve& curve);
ErrorCurve curve_from_json(const std::string& text);

/// Per-batch images of a running job. Not bit-exact (floats); only error estimates come from it. Above
/// kMaxTrackedPixels it follows a fixed pseudo-random subset of the pixels.
class BatchFilm {
 public:
  static constexpr int64_t kMaxTrackedPixels = 262144;
  explicit BatchFilm(const FilmGrid& grid);
  /// Adds a partial; its tile must not cross an aligned group of superblocks (see `max_tile_superblocks`).
  void fold(const Partial& partial);
  /// Largest aligned run of superblocks that a new tile may span.
  int64_t max_tile_superblocks() const { return group_; }
  /// Fills relmse, relmse_low, relmse_high and batches from the complete batches.
  void estimate(ErrorPoint* point) const;
  std::string snapshot() const;
  static BatchFilm restore(std::string_view bytes);

 private:
  FilmGrid grid_;
  int64_t group_ = 1;              // superblocks per batch
  std::vector<uint32_t> tracked_;  // pixel indices (y * width + x), ascending
  struct Batch {
    std::vector<float> rgb;  // 3 per tracked pixel: sum of contributions / samples per superblock
    int64_t samples = 0;     // pixel-samples folded (all pixels), to know when it is complete
  };
  std::vector<Batch> batches_;
};

}  // namespace lightmill
