#pragma once
// What a scene's photon guide does to the noise of its image, and what other shares of guided paths would do.
#include <array>

#include "worker/render/pipeline/context.h"
#include "worker/render/pipeline/recording/strategy_recorder.h"

namespace lightmill {

struct GuideTrial {
  /// Variance for each share (kGuideShares), weighed as in relMSE and summed over the pilot pixels; by half
  /// of the samples.
  std::array<std::array<double, kGuideShares.size()>, 2> noise{};
  /// Camera paths that hit a light because of the guide (`led`), how many would have without it, and how many
  /// paths of equal light would be as noisy (effective sample size, Kish 1965). Where nearly all that are led
  /// to a light miss it, few paths have all of its light.
  double led = 0, led_unguided = 0, led_effective = 0;
};

/// Traces `paths` camera paths at most; fewer for an image so small that they would take longer than it.
/// `context`: of the scene with its guide, the whole film, and the strategies that are to run. The result is
/// the same for any number of `threads`.
GuideTrial try_guide(const StageContext& context, int64_t paths, int threads);

}  // namespace lightmill
