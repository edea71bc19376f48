#pragma once
// What every strategy adds to the image, and how much of its noise.
#include <memory>
#include <vector>

#include "common/image/image.h"
#include "worker/render/pipeline/strategy_recorder.h"

namespace lightmill {

/// Sums over samples of one strategy's contributions, per pixel and channel.
struct StrategyLayer {
  std::vector<float> weighted, unweighted, squares;
};

class StrategyFilm {
 public:
  /// Bytes of one strategy's layer per pixel.
  static constexpr int64_t kBytesPerPixel = 36;

  StrategyFilm(int width, int height) : width_(width), height_(height) {}
  void add(const StrategyContribution& c);

  /// Means over `spp` samples: with MIS weights, or as if the strategy were alone (of the paths it samples).
  /// Null if it added nothing.
  std::unique_ptr<Image> weighted(int s, int t, double spp) const;
  std::unique_ptr<Image> unweighted(int s, int t, double spp) const;
  /// Mean over pixels and channels of the variance of one sample per pixel over (image^2 + 0.01): what the
  /// strategy adds to relMSE at 1 spp, covariances with other strategies aside. Splats are taken as compound
  /// Poisson: the second moment.
  double relative_variance(int s, int t, double spp, const Image& image) const;

 private:
  const StrategyLayer* layer(int s, int t) const;
  std::unique_ptr<Image> mean_of(const std::vector<float>& sums, double spp) const;

  int width_, height_;
  std::unique_ptr<StrategyLayer> layers_[kRecordedVertices + 1][kRecordedVertices + 1];
};

}  // namespace lightmill
