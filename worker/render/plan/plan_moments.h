#pragma once
// What sampling plans would make of recorded paths: the variance of a pixel sample under each of them, from
// samples of the plan that has every strategy (Grittmann et al., "Efficiency-Aware Multiple Importance
// Sampling for Bidirectional Rendering Algorithms", 2022, eqs. 9-12).
#include <array>
#include <memory>
#include <vector>

#include "common/image/grid.h"
#include "common/sampling_plan.h"
#include "worker/render/pipeline/strategy_recorder.h"

namespace lightmill {

/// Most plans that are weighed against each other.
inline constexpr int kMaxPlans = 72;

/// A float per plan.
using PerPlan = std::array<float, kMaxPlans>;

/// The plans under consideration, as factors on the samples of each family relative to the plan that is
/// recorded: every strategy, one light path, one connection.
struct PlanSet {
  explicit PlanSet(std::vector<SamplingPlan> candidates);
  std::vector<SamplingPlan> plans;
  PerPlan hit{}, next_event{}, lens{}, connect{};
};

/// Sums over the pixels of one block that are looked at, per channel. Two halves of the pixels are kept
/// apart, like the squares of a chessboard: what one says can be tested on the other.
struct BlockMoments {
  std::array<int, 2> pixels{}, looked_at{};  // per half: in the crop window, and of them looked at
  std::array<float, 3> mean{};               // pixel values
  std::array<PerPlan, 3> camera[2], splat;   // variance of one pixel sample: camera layer per half, splats
  BlockMoments() { camera[0].fill({}), camera[1].fill({}), splat.fill({}); }
  BlockMoments& operator+=(const BlockMoments& o);
  int all_looked_at() const { return looked_at[0] + looked_at[1]; }
};
inline size_t half_of(int x, int y) { return static_cast<size_t>((x ^ y) & 1); }

/// A contribution of the lens strategy, kept until the moments of all cells are known.
struct RecordedSplat {
  uint32_t pixel;
  float rgb[3];
  FamilyShares shares;
};

/// Result of one cell: of its pixels inside the crop window.
struct CellMoments {
  std::vector<BlockMoments> blocks;   // row-major
  std::vector<RecordedSplat> splats;  // anywhere on the film
  PerPlan lost{};                     // light that a plan has no strategy for
};

/// Takes the samples of one cell after another; one per thread.
class MomentRecorder {
 public:
  /// Blocks are squares of `side` pixels, a divisor of kCellSize.
  MomentRecorder(const PlanSet& plans, int side) : plans_(plans), side_(side) {}
  void begin_cell();
  /// All contributions of one sample index of the cell.
  void add_sample(const std::vector<StrategyContribution>& contributions);
  /// Per pixel of the cell, row-major: whether it is in the crop window and whether it was looked at. At
  /// least two samples.
  CellMoments end_cell(const std::array<bool, kCellPixels>& inside,
                       const std::array<bool, kCellPixels>& looked_at);

 private:
  /// Of a pixel's samples x under each plan, camera layer only.
  struct Pixel {
    std::array<PerPlan, 3> sum{}, squares{};
  };
  BlockMoments& block_of(int slot) {
    const int columns = kCellSize / side_;
    return cell_.blocks[static_cast<size_t>(slot / kCellSize / side_ * columns + slot % kCellSize / side_)];
  }
  void add_path(int slot, const StrategyContribution* const* first, size_t count);

  const PlanSet& plans_;
  const int side_;
  CellMoments cell_;
  std::vector<Pixel> pixels_;
  std::vector<const StrategyContribution*> by_slot_;
  int samples_ = 0;
};

/// Adds a splat to its block, on a pixel of that half, `scale` times.
void add_splat(const PlanSet& plans, const RecordedSplat& splat, size_t half, float scale,
               BlockMoments* block, PerPlan* lost);

}  // namespace lightmill
