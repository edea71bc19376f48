#pragma once
// The batches of a running job, from which its error is estimated (README.md).
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/error/error_curve.h"
#include "common/error/tracked_pixels.h"
#include "common/film/partial.h"
#include "common/image/image.h"

namespace lightmill {

/// Per-batch images of a running job. Not bit-exact (floats): only error estimates come from them. Of large
/// films it follows a part (tracked_pixels.h). Not thread-safe.
///
/// A batch is a range of superblocks of one replicate (common/job/replicates.h). It is complete when every
/// pixel of the crop window has all its samples and the light paths that belong to them, one per pixel
/// sample. A superblock that the job's spp cuts never completes. It only counts towards the samples that the
/// image rests on.
class BatchFilm {
 public:
  static constexpr int64_t kMaxTrackedPixels = TrackedPixels::kMost;
  static constexpr int64_t kMaxBatches = 32;
  BatchFilm() = default;
  explicit BatchFilm(const FilmGrid& grid);
  /// Adds a partial, once. A tile that crosses an aligned group of superblocks (see `max_tile_superblocks`)
  /// merges batches until it fits into one. What has samples of both replicates belongs to no batch. Throws
  /// Error(kFailed) if the grid differs.
  void fold(const Partial& partial);
  /// Largest aligned run of superblocks that a new tile may span without costing batches.
  int64_t max_tile_superblocks() const { return group_; }
  /// Fills relmse (empty below 2 complete batches), relmse_low, relmse_high (below 4) and batches, and the
  /// same of the boxes.
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
    TrackedSums sums;     // of contributions; empty until the first arrives
    int64_t samples = 0;  // pixel samples folded (all pixels), to know when it is complete
  };
  void merge_pairs();
  /// Finds places for batches that an older version kept, each of a range of superblocks of its own scramble.
  /// Those of several superblocks belong to none any more, nor do those of other pixels.
  void take_older_batches(bool of_other_pixels);
  struct Complete {
    std::vector<const Batch*> batches;
    std::vector<int> replicates;  // of each
  };
  Complete complete_batches() const;

  FilmGrid grid_;
  TrackedPixels tracked_;
  int64_t group_ = 1;          // superblocks per batch
  int64_t mixed_samples_ = 0;  // pixel samples of tiles that belong to no batch
  /// Batch 2 i + r: superblocks [i * group_, (i + 1) * group_) of replicate r.
  std::vector<Batch> batches_;
};

}  // namespace lightmill
