#include "worker/render/diagnose/strategy_film.h"

#include <algorithm>

namespace lightmill {

StrategyFilm::StrategyFilm(int width, int height, const SplatStatistics& splats)
    : width_(width), height_(height), splats_(splats) {
  const size_t values = static_cast<size_t>(width) * static_cast<size_t>(height) * 3;
  for (size_t i = 0; i < kSets; ++i) {
    second_[i].resize(values);
    camera_[i].resize(values);
  }
}

void StrategyFilm::add(const StrategyContribution& c) {
  auto& layer = layers_[std::min(c.s, kRecordedVertices)][std::min(c.t, kRecordedVertices)];
  if (!layer) {
    layer = std::make_unique<StrategyLayer>();
    const size_t values = static_cast<size_t>(width_) * static_cast<size_t>(height_) * 3;
    layer->weighted.resize(values);
    layer->unweighted.resize(values);
    layer->squares.resize(values);
  }
  for (size_t k = 0; k < 3; ++k) {
    const size_t i = size_t{c.pixel} * 3 + k;
    layer->weighted[i] += c.rgb[k];
    layer->squares[i] += c.rgb[k] * c.rgb[k] * (c.t == 1 ? splats_.noise : 1);
    if (c.weight > 0) layer->unweighted[i] += c.rgb[k] / c.weight;
  }
  for (size_t i = 0; i < kSets; ++i) {
    // A path that the set can hardly make has next to no share: that is where its noise comes from.
    const float share = c.shares.of(set(i));
    if (!(share > 0)) continue;
    const float camera = c.shares.of(set(i) & kCameraLayer) / share;
    // Light paths count for `weight` samples: a splat's share of the light is that much less than it would
    // be.
    const float second =
        (camera + (1 - camera) * splats_.noise * splats_.weight) / share / (c.t == 1 ? splats_.weight : 1);
    for (size_t k = 0; k < 3; ++k) {
      second_[i][size_t{c.pixel} * 3 + k] += c.rgb[k] * c.rgb[k] * second;
      camera_[i][size_t{c.pixel} * 3 + k] += c.rgb[k] * camera;
    }
  }
}

void StrategyFilm::add_sample(const std::vector<StrategyContribution>& contributions) {
  // Per path slot, set and channel: the sum that the set's own camera path would bring, and
  // that of its squares.
  struct Moments {
    float sum[3] = {0, 0, 0}, squares[3] = {0, 0, 0};
    uint32_t pixel = 0;
  };
  std::vector<Moments> moments(size_t{kWavefront} * kSets);
  for (const StrategyContribution& c : contributions) {
    add(c);
    if (c.t < 2) continue;
    const Strategies family = c.s == 0 ? kEmissionHits : c.s == 1 ? kNextEvent : kVertexConnections;
    for (size_t i = 0; i < kSets; ++i) {
      const float share = c.shares.of(set(i));
      if (!(set(i) & family) || !(share > 0)) continue;
      Moments& m = moments[static_cast<size_t>(c.slot) * kSets + i];
      m.pixel = c.pixel;
      for (size_t k = 0; k < 3; ++k) {
        const float x = c.rgb[k] / share;
        m.sum[k] += x;
        m.squares[k] += x * x;
      }
    }
  }
  for (size_t n = 0; n < moments.size(); ++n) {
    const Moments& m = moments[n];
    for (size_t k = 0; k < 3; ++k) {
      second_[n % kSets][size_t{m.pixel} * 3 + k] += m.sum[k] * m.sum[k] - m.squares[k];
    }
  }
}

double StrategyFilm::predicted_variance(size_t set, double spp, const Image& image) const {
  double sum = 0;
  for (size_t i = 0; i < second_[set].size(); ++i) {
    const double mean = camera_[set][i] / spp, r = image.data[i];
    sum += std::max(second_[set][i] / spp - mean * mean, 0.0) / (r * r + 1e-2);
  }
  return sum / static_cast<double>(second_[set].size());
}

const StrategyLayer* StrategyFilm::layer(int s, int t) const { return layers_[s][t].get(); }

std::unique_ptr<Image> StrategyFilm::mean_of(const std::vector<float>& sums, double spp) const {
  auto image = std::make_unique<Image>(width_, height_);
  for (size_t i = 0; i < sums.size(); ++i) image->data[i] = static_cast<float>(sums[i] / spp);
  return image;
}

std::unique_ptr<Image> StrategyFilm::weighted(int s, int t, double spp) const {
  const StrategyLayer* l = layer(s, t);
  return l ? mean_of(l->weighted, spp) : nullptr;
}

std::unique_ptr<Image> StrategyFilm::unweighted(int s, int t, double spp) const {
  const StrategyLayer* l = layer(s, t);
  return l ? mean_of(l->unweighted, spp) : nullptr;
}

double StrategyFilm::relative_variance(int s, int t, double spp, const Image& image) const {
  const StrategyLayer* l = layer(s, t);
  if (!l) return 0;
  double sum = 0;
  for (size_t i = 0; i < l->squares.size(); ++i) {
    const double mean = l->weighted[i] / spp, second = l->squares[i] / spp, r = image.data[i];
    sum += std::max(second - (t == 1 ? 0 : mean * mean), 0.0) / (r * r + 1e-2);
  }
  return sum / static_cast<double>(l->squares.size());
}

}  // namespace lightmill
