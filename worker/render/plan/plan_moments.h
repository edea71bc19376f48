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
/// Side of the pixel blocks that moments are averaged over, and how many a cell has.
inline constexpr int kMomentBlock = 8;
inline constexpr int kBlocksPerCell = (kCellSize / kMomentBlock) * (kCellSize / kMomentBlock);

/// A float per plan.
using PerPlan = std::array<float, kMaxPlans>;

/// The plans under consideration, as factors on the samples of each family relative to the plan that is
/// recorded: every strategy, one light path, one connection.
struct PlanSet {
  explicit PlanSet(std::vector<SamplingPlan> candidates);
  std::vector<SamplingPlan> plans;
  PerPlan hit{}, next_event{}, lens{}, connect{};
};

/// Sums over the pixels of one block, per channel.
struct BlockMoments {
  int pixels = 0;
  std::array<float, 3> mean{};               // pixel values
  std::array<PerPlan, 3> camera{}, splat{};  // variance of one pixel sample: camera layer, lens connections
};

/// A contribution of the lens strategy, kept until the moments of all cells are known.
struct RecordedSplat {
  uint32_t pixel;
  float rgb[3];
  FamilyShares shares;
};

/// Result of one cell: of its pixels inside the crop window.
struct CellMoments {
  std::array<BlockMoments, kBlocksPerCell> blocks;
  std::vector<RecordedSplat> splats;  // anywhere on the film
  PerPlan lost{};                     // light that a plan has no strategy for
};

/// Takes the samples of one cell after another; one per thread.
class MomentRecorder {
 public:
  explicit MomentRecorder(const PlanSet& plans) : plans_(plans) {}
  void begin_cell();
  /// All contributions of one sample index of the cell.
  void add_sample(const std::vector<StrategyContribution>& contributions);
  /// `inside`: the cell's pixels in the crop window, row-major. At least two samples.
  CellMoments end_cell(const std::array<bool, kCellPixels>& inside);

 private:
  /// Of a pixel's samples x under each plan, camera layer only.
  struct Pixel {
    std::array<PerPlan, 3> sum{}, squares{};
  };
  void add_path(int slot, const StrategyContribution* const* first, size_t count);

  const PlanSet& plans_;
  CellMoments cell_;
  std::vector<Pixel> pixels_;
  std::vector<const StrategyContribution*> by_slot_;
  int samples_ = 0;
};

/// Adds a splat to its block, `scale` times.
void add_splat(const PlanSet& plans, const RecordedSplat& splat, float scale, BlockMoments* block,
               PerPlan* lost);

}  // namespace lightmill
