#pragma once
// Predicts the variance of a pixel sample under every sampling plan, from recorded samples of the plan that
// has every strategy (Grittmann et al., "Efficiency-Aware Multiple Importance Sampling for Bidirectional
// Rendering Algorithms", 2022, eqs. 9-12).
#include <array>
#include <span>
#include <vector>

#include "common/job/packet_grid.h"
#include "worker/render/pipeline/recording/strategy_recorder.h"
#include "worker/render/plan/plan_set.h"
#include "worker/render/plan/rare_paths.h"
#include "worker/render/plan/relative_weights.h"

namespace lightmill {

/// Weighed sums over the pilot pixels of one block, per channel. The pixels are kept in two halves, like the
/// squares of a chessboard: what one half says can be tested on the other.
struct BlockMoments {
  std::array<int, 2> pixels{}, looked_at{};  // per half: in the crop window; pilot pixels
  std::array<PerPlan, 3> camera[2], splat;   // variance of one pixel sample: camera layer per half, splats
  // Per half, all channels: what roulette at event kLeastRrDepth would add, and what is in `camera` of
  // samples that a longer sequence makes more even.
  std::array<PerPlan, 2> roulette{}, even{};
  BlockMoments() { camera[0].fill({}), camera[1].fill({}), splat.fill({}); }
  BlockMoments& operator+=(const BlockMoments& o);
  int all_previewed() const { return looked_at[0] + looked_at[1]; }
};
inline size_t half_of(int x, int y) { return static_cast<size_t>((x ^ y) & 1); }

/// A splat of light tracing, kept until the moments of all cells are known.
struct RecordedSplat {
  uint32_t pixel;
  float rgb[3];
  float size;    // StrategyContribution::size
  bool emitter;  // s = t = 1
  FamilyShares shares;
};

/// Shadow rays of one family that arrived, and how many would have under each plan, per sample of the family.
/// Where more samples share the light, more of them are small and lost to roulette.
struct RayCounts {
  double recorded = 0;
  std::array<double, kMaxPlans> kept{};
  RayCounts& operator+=(const RayCounts& o);
  double share(size_t plan) const { return recorded > 0 ? kept[plan] / recorded : 1; }
};

/// Number of the block that pixel `slot` of a cell is in: blocks of `side` x `side` pixels, row-major.
inline size_t block_of_slot(int slot, int side) {
  return static_cast<size_t>(slot / kCellSize / side * (kCellSize / side) + slot % kCellSize / side);
}

/// What one cell's pixels inside the crop window say.
struct CellMoments {
  std::vector<BlockMoments> blocks;   // row-major
  std::vector<RecordedSplat> splats;  // anywhere on the film
  PerPlan lost{};                     // light that a plan has no strategy for
  RayCounts next_event, lens, connect;
  RarePaths rare;
};

/// Takes the samples of one cell after another. One per thread.
class MomentRecorder {
 public:
  /// Blocks are squares of `side` pixels, a divisor of kCellSize.
  MomentRecorder(const PlanSet& plans, int side);
  /// `values`: per pixel of the cell, row-major.
  void begin_cell(const std::array<PixelValue, kCellPixels>& values);
  /// Adds all contributions of one sample index of the cell, which is in the first or the second `block` of
  /// samples (0, 1). Each has half of the samples: stratified within, independent of the other's. `survival`:
  /// StrategyRecorder::survival_of_path.
  void add_sample(const std::vector<StrategyContribution>& contributions, std::span<const float> survival,
                  int block);
  /// Per pixel of the cell, row-major: whether it is in the crop window, and whether it is a pilot pixel. At
  /// least two samples must have been added, and no contributions of other pixels.
  CellMoments end_cell(const std::array<bool, kCellPixels>& inside,
                       const std::array<bool, kCellPixels>& looked_at);

 private:
  /// Sums of a pixel's samples x under each plan, camera layer only.
  struct Pixel {
    std::array<PerPlan, 3> sums[2]{}, squares{}, even[2]{};  // per block; `even`: without what is rare
  };
  BlockMoments& block_of(int slot) { return cell_.blocks[block_of_slot(slot, side_)]; }
  void add_path(int slot, int block, const StrategyContribution* const* first, size_t count, float survival);
  void add_pairs(const std::array<PerPlan, 3>& sum, const std::array<PerPlan, 3>& squares, int slot);

  const PlanSet& plans_;
  const int side_;
  CellMoments cell_;
  std::array<PixelValue, kCellPixels> values_;
  std::vector<Pixel> pixels_;  // zero between cells
  std::vector<const StrategyContribution*> by_slot_;
  int samples_ = 0;
};

/// Adds a splat, `scale` times, to its block, on a pixel of `half` that has the value `value`. Adds what is
/// counted of it to `cell`, which it stems from.
void add_splat(const PlanSet& plans, const RecordedSplat& splat, const PixelValue& value, size_t half,
               float scale, BlockMoments* block, CellMoments* cell);

}  // namespace lightmill
