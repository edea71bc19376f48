#pragma once
// What the caustic guide that a scene has does to the noise of its image, and what other shares of it would.
#include <array>

#include "worker/render/pipeline/context.h"
#include "worker/render/pipeline/recording/strategy_recorder.h"

namespace lightmill {

struct GuideTrial {
  /// Variance per share (kGuideShares), weighed as in relMSE and summed over what is looked at; by half of
  /// the samples.
  std::array<std::array<double, kGuideShares.size()>, 2> noise{};
  /// Camera paths that met a light because of the guide, how many would have without it, and how many of
  /// equal light would be as noisy (Kish 1965): where nearly all that are led to a light miss it, few have
  /// all of its light.
  double led = 0, led_unguided = 0, led_effective = 0;
};

/// By `paths` camera paths at most; fewer of an image so small that they would take longer than it.
/// `context`: of the scene with its guide, the whole film and the strategies that are to run. On `threads`
/// threads, of which no bit depends.
GuideTrial try_guide(const StageContext& context, int64_t paths, int threads);

}  // namespace lightmill
