#pragma once
// How the noise of camera paths falls with the number of samples, under every sampling plan.
//
// The samples of a pixel are one low-discrepancy sequence (common/job/replicates.h), so the variance of their
// mean falls faster than 1 / n: how much faster depends on the scene and on the plan. A pilot's few samples
// of many pixels do not show it. So some pixels are sampled deeply, in both replicates. Half the squared
// difference of the two is the variance, without bias.
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "common/job/packet_grid.h"
#include "worker/render/pipeline/recording/strategy_recorder.h"
#include "worker/render/plan/pilot_values.h"
#include "worker/render/plan/plan_set.h"
#include "worker/render/renderer.h"

namespace lightmill {

/// Numbers of samples of one replicate at which the variance is measured.
inline constexpr std::array<int, 3> kMeasuredLengths{4, 16, 64};

/// Samples that a pixel has of one replicate in a render of `spp`, about.
double samples_of_replicate(int64_t spp);

/// Variance of the mean of n samples of camera paths, times n, weighed as in relMSE and summed over pixels
/// and channels: for each of kMeasuredLengths and each plan. Rare bright contributions are apart: no sequence
/// makes them more even, and with them the differences would tell nothing else.
struct Convergence {
  std::array<std::array<double, kMaxPlans>, kMeasuredLengths.size()> variance{};
  Convergence& operator+=(const Convergence& o);
  /// The variance with `samples` of a replicate over that with `of`, per plan: a power law between measured
  /// lengths, and beyond them. 1 if nothing is known.
  PerPlan ratio(double samples, double of) const;
};

/// Takes the samples of one cell after another. One per thread.
class ConvergenceRecorder {
 public:
  explicit ConvergenceRecorder(const PlanSet& plans);
  struct DeepPixel {
    int slot;  // in the cell, row-major
    PixelValue value;
  };
  void begin_cell(const std::vector<DeepPixel>& pixels);
  /// All contributions of one sample index of replicate 0, then those of the same index of replicate 1, and
  /// so on: kMeasuredLengths.back() of each.
  void add_sample(const std::vector<StrategyContribution>& contributions, int replicate);
  const Convergence& end_cell();

 private:
  static constexpr size_t kLengths = kMeasuredLengths.size();
  struct Pixel {
    std::array<float, 3> weight{}, rare{};  // per channel
    std::array<std::array<PerPlan, 3>, kLengths>
        differences{};  // of the replicates: of the block that is open
  };
  void close_block(size_t length);

  const PlanSet& plans_;
  std::array<int16_t, kCellPixels> pixel_of_slot_;
  std::vector<Pixel> pixels_;
  Convergence cell_;
  int samples_ = 0;
};

/// Samples `pixels` deep pixels, or fewer in a small film, with kMeasuredLengths.back() samples of both
/// replicates. Throws Error(kFailed) once go_on() is false.
Convergence measure_convergence(const Renderer& scene, const RenderSettings& settings, const PlanSet& plans,
                                const PilotValues& values, int64_t pixels, int threads,
                                const std::function<bool()>& go_on);

}  // namespace lightmill
