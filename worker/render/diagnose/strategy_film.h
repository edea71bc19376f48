#pragma once
// What every strategy adds to the image, and how much of its noise.
#include <memory>
#include <vector>

#include "common/image/image.h"
#include "worker/render/pipeline/recording/strategy_recorder.h"

namespace lightmill {

/// Sums over samples of one strategy's contributions, per pixel and channel.
struct StrategyLayer {
  std::vector<float> weighted, unweighted, squares;
};

/// Of a render's splats of light tracing.
struct SplatStatistics {
  float noise = 1;   // PixelFilter::splat_noise
  float weight = 1;  // SamplingPlan::light_tracing_weight
};

class StrategyFilm {
 public:
  /// Bytes of one strategy's layer per pixel.
  static constexpr int64_t kBytesPerPixel = 36;
  /// The sets whose noise is predicted: all with emission hits.
  static constexpr size_t kSets = 8;
  static constexpr Strategies set(size_t i) { return kEmissionHits | static_cast<Strategies>(2 * i); }

  static constexpr int64_t kBytesOfSets = kSets * 24;

  StrategyFilm(int width, int height, const SplatStatistics& splats);
  /// All contributions of one sample index of one cell.
  void add_sample(const std::vector<StrategyContribution>& contributions);

  /// Means over `spp` samples: with MIS weights, or as if the strategy were alone (of the paths it samples).
  /// Null if it added nothing.
  std::unique_ptr<Image> weighted(int s, int t, double spp) const;
  std::unique_ptr<Image> unweighted(int s, int t, double spp) const;
  /// Mean over pixels and channels of the variance of one sample per pixel over (image^2 + 0.01): what the
  /// strategy adds to relMSE at 1 spp, covariances with other strategies aside. Splats are taken as compound
  /// Poisson: the second moment, of what the pixels that share them receive.
  double relative_variance(int s, int t, double spp, const Image& image) const;

  /// What one sample of the families `set(i)` alone would have: relative variance as above. The second moment
  /// of single contributions is taken over the samples of all strategies that ran, so that paths which the
  /// set can hardly make count (FamilyShares); what the contributions of one camera path have in common, over
  /// those of the set, weighted as it would. What stratified sampling gains is left out, alike for every set.
  double predicted_variance(size_t i, double spp, const Image& image) const;

 private:
  void add(const StrategyContribution& c);
  const StrategyLayer* layer(int s, int t) const;
  std::unique_ptr<Image> mean_of(const std::vector<float>& sums, double spp) const;

  int width_, height_;
  SplatStatistics splats_;
  std::vector<float> second_[kSets];  // second moments, per pixel and channel
  std::vector<float> camera_[kSets];  // what the camera layer would hold
  std::unique_ptr<StrategyLayer> layers_[kRecordedVertices + 1][kRecordedVertices + 1];
};

}  // namespace lightmill
