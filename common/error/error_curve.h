#pragma once
// Error against run time: the curve of a job, and the batch images that its estimate rests on.
//
// Estimate. relMSE = mean((I-R)^2 / (R^2 + 1e-2)) over pixels and channels. Superblocks (16 samples, camera
// and splat layers together) are grouped into 16..31 batches of equally many superblocks (pairs of neighbours
// are merged when a 33rd begins). The error of the mean of n batches is estimated from each batch's squared
// deviation over the whole image, corrected for the noise in its own denominator. The interval covers the
// error of the image at hand. It rests on whole-image values of the batches, never on the spread over pixels
// (derivation: error_estimate.cc). With fewer than 16 complete superblocks the same is done with those there
// are, and the point says how many `batches` it rests on: the estimate takes 2, its interval 4.
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/error/error_estimate.h"
#include "common/film/partial.h"
#include "common/image/image.h"
#include "common/job/pixel_interleave.h"

namespace lightmill {

struct ErrorPoint {
  double wall_seconds = 0;
  double cpu_seconds = 0;
  double spp = 0;
  std::optional<double> relmse;                   // estimated
  std::optional<double> relmse_low, relmse_high;  // its 95 % interval, from 4 batches on
  int batches = 0;
  // Only with a reference image:
  std::optional<double> true_relmse, true_relmse_trimmed, true_flip;
};

/// The rule of --target-error: the upper end of the interval is below the target (0: none). Applied at
/// checkpoints (checkpoints.h) only.
inline bool meets_target(const ErrorPoint& point, double target) {
  return target > 0 && point.relmse_high && *point.relmse_high < target;
}

struct ErrorCurve {
  std::string job_name;
  std::vector<ErrorPoint> points;
};

/// JSON, the form that is stored and sent. curve_from_json throws Error(kFailed).
std::string curve_to_json(const ErrorCurve& curve);
ErrorCurve curve_from_json(const std::string& text);

/// Per-batch images of a running job. Not bit-exact (floats): only error estimates come from them. Above
/// kMaxTrackedPixels it follows a fixed pseudo-random subset of the pixels, in short runs. Not thread-safe.
///
/// A batch is a range of superblocks of one replicate (common/job/replicates.h). It is complete when every
/// pixel of the crop window has all its samples and the light paths that belong to them, one per pixel
/// sample. A superblock that the job's spp cuts never completes. It only counts towards the samples that the
/// image rests on.
class BatchFilm {
 public:
  static constexpr int64_t kMaxTrackedPixels = 262144;
  static constexpr int64_t kMaxBatches = 32;
  BatchFilm() = default;
  explicit BatchFilm(const FilmGrid& grid);
  /// Adds a partial, once. A tile that crosses an aligned group of superblocks (see `max_tile_superblocks`)
  /// merges batches until it fits into one. What has samples of both replicates belongs to no batch. Throws
  /// Error(kFailed) if the grid differs.
  void fold(const Partial& partial);
  /// Largest aligned run of superblocks that a new tile may span without costing batches.
  int64_t max_tile_superblocks() const { return group_; }
  /// Fills relmse (empty below 2 complete batches), relmse_low, relmse_high (below 4) and batches.
  void estimate(ErrorPoint* point) const;
  /// Where the noise is. Per block of `block` x `block` pixels (one channel, rows from the top, the last ones
  /// cut): the mean over its tracked pixels and channels of var / (M^2 + 1e-2). M is the mean of the complete
  /// batches, and var the variance of that mean over the batches, scaled to all samples folded so far. NaN
  /// where no pixel is tracked; no pixels below 2 complete batches. The weight is that of the image at hand,
  /// so this is for display; the error of the image is `estimate`.
  Image error_map(int block) const;
  /// A size of blocks of which each holds some tracked pixels.
  int error_map_block() const;
  /// Mean samples per pixel folded so far.
  double spp() const;
  std::string snapshot() const;
  /// Throws Error(kFailed) on corruption.
  static BatchFilm restore(std::string_view bytes);

 private:
  struct Batch {
    std::vector<float> rgb;  // 3 per tracked pixel: sum of contributions; empty until the first arrives
    int64_t samples = 0;     // pixel samples folded (all pixels), to know when it is complete
  };
  /// Adds the sums `from` of the pixels of `r`, row-major in packet order, in units of `unit`, to a batch's
  /// `rgb`.
  void add_camera(const PixelRect& r, const ExactRgb* from, double unit, float* rgb) const;
  PixelLayout layout() const;
  void merge_pairs();
  /// Finds places for batches that an older version kept, each of a range of superblocks of its own scramble.
  /// Those of several superblocks belong to none any more.
  void take_older_batches();
  struct Complete {
    std::vector<const Batch*> batches;
    std::vector<int> replicates;  // of each
  };
  Complete complete_batches() const;

  FilmGrid grid_;
  int64_t group_ = 1;          // superblocks per batch
  int64_t mixed_samples_ = 0;  // pixel samples of tiles that belong to no batch
  int64_t tracked_pixels_ = 0;
  PixelInterleave interleave_;
  std::vector<int64_t> tracked_;  // runs of 8 pixels of the crop window, ascending; empty: all pixels
  struct TrackedPlace {
    uint32_t in_packets, at;  // index in the crop window in packet order; number among the tracked pixels
  };
  std::vector<TrackedPlace> tracked_places_;  // of the pixels of tracked_, ascending
  /// Batch 2 i + r: superblocks [i * group_, (i + 1) * group_) of replicate r.
  std::vector<Batch> batches_;
};

}  // namespace lightmill
