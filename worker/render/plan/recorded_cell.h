#pragma once
// Records the samples of one cell of the pilot pixels. Preview passes, of light paths and of a guide's trial,
// have this in common.
#include <memory>
#include <utility>
#include <vector>

#include "worker/render/pipeline/pipeline.h"
#include "worker/render/plan/pilot_pixels.h"
#include "worker/render/plan/pilot_values.h"
#include "worker/render/plan/pixel_noise.h"

namespace lightmill {

/// Renders all samples of cell number `i` of `sight` and calls sample(recorder, counters, block) after each.
/// `weigh_guide` as in StrategyRecorder.
template <class Sample>
void record_samples(const StageContext& context, const PilotPixels& pilot_pixels, size_t i, bool weigh_guide,
                    Sample&& sample) {
  const auto wavefront = std::make_unique<Wavefront>();
  const auto recorder = std::make_unique<StrategyRecorder>();
  recorder->weigh_guide = weigh_guide;
  wavefront->recorder = recorder.get();
  const CellRect rect = pilot_pixels.rect(i);
  for (int64_t j = 0; j < pilot_pixels.samples; ++j) {
    const int64_t s = pilot_pixels.index(j);
    render_packet(context, {rect.x0, rect.y0, s, s + 1}, 0, *wavefront, nullptr);
    sample(*recorder, wavefront->counters, pilot_pixels.block(j));
    recorder->clear();
  }
}

/// Renders all samples of cell number `i` of `sight` and gives their values to `values`. take(recorder, k,
/// block) gets the number of every contribution and says whether it counts for the noise that is returned.
/// `weigh_guide` as in StrategyRecorder.
template <class Take>
std::vector<PixelNoise> record_cell(const StageContext& context, const PilotPixels& pilot_pixels, size_t i,
                                    bool weigh_guide, PilotValues* values, Take&& take) {
  CellPreview preview;
  CameraSums camera;
  const auto add_sample = [&](const StrategyRecorder& recorder, const RenderCounters& counters, int block) {
    preview.add(recorder.contributions, counters.light_paths);
    for (size_t k = 0; k < recorder.contributions.size(); ++k) {
      if (take(recorder, k, block)) camera.add(recorder.contributions[k]);
    }
    camera.end_sample();
  };
  record_samples(context, pilot_pixels, i, weigh_guide, add_sample);
  values->take(i, std::move(preview));
  return camera.noise(context.grid, pilot_pixels.rect(i), pilot_pixels.samples);
}

/// The variance of these pixels, weighed as in relMSE and summed over pixels and channels.
inline double weighed_sum(const std::vector<PixelNoise>& noise, const PilotValues& values) {
  double sum = 0;
  for (const PixelNoise& n : noise) {
    const PixelValue value = values.of(n.pixel);
    for (size_t ch = 0; ch < 3; ++ch) sum += n.variance[ch] * double{value.weight(ch)};
  }
  return sum;
}

}  // namespace lightmill
