#include "worker/render/diagnose/strategy_film.h"

#include <algorithm>

namespace lightmill {

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
    layer->squares[i] += c.rgb[k] * c.rgb[k];
    if (c.weight > 0) layer->unweighted[i] += c.rgb[k] / c.weight;
  }
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
