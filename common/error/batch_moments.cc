#include "common/error/batch_moments.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "common/error/error_weights.h"

namespace lightmill {

namespace {

constexpr size_t kStrip = 512;        // values per pass: mean and variance stay in the L1 cache
constexpr size_t kBandValues = 4096;  // about so many at once of each batch, which stay in the L2 cache
constexpr size_t kLanes = 8;          // independent sums: a single chain of additions would be all latency
static_assert(kStrip % kLanes == 0);

template <class Lanes>
double sum_of(const Lanes& lanes) {
  double sum = 0;
  for (size_t k = 0; k < kLanes; ++k) sum += static_cast<double>(lanes[k]);
  return sum;
}

/// Rows of the image with those around them, whose neighbours are asked, too.
struct Band {
  size_t first = 0;                         // index of its first value in a batch
  std::vector<float> mean, variance;        // M and the variance t of M
  std::vector<double> exact_mean, squares;  // of what they are made
  Neighbourhood around, near;
};

/// Finds mean and variance of so many values from `band->first` on.
void find_mean(std::span<const float* const> sums, size_t values, double to_mean, Band* band) {
  const auto n = static_cast<double>(sums.size());
  band->mean.resize(values);
  band->variance.resize(values);
  band->exact_mean.assign(values, 0);
  band->squares.assign(values, 0);
  double* mean = band->exact_mean.data();
  double* squares = band->squares.data();
  for (const float* sum : sums) {
    const float* from = sum + band->first;
    for (size_t i = 0; i < values; ++i) mean[i] += static_cast<double>(from[i]) * (to_mean / n);
  }
  for (const float* sum : sums) {
    const float* from = sum + band->first;
    for (size_t i = 0; i < values; ++i) {
      const double deviation = static_cast<double>(from[i]) * to_mean - mean[i];
      squares[i] += deviation * deviation;
    }
  }
  for (size_t i = 0; i < values; ++i) {
    band->mean[i] = static_cast<float>(mean[i]);
    band->variance[i] = static_cast<float>(squares[i] / (n * (n - 1)));
  }
}

/// The moments so far, as sums, and space for a strip.
struct Sums : BatchMoments {
  explicit Sums(size_t count) : BatchMoments(count), deviations(count * kStrip) {}
  std::vector<float> deviations;  // weighted, of one strip: kStrip floats a batch
};

/// to[k] += the product of the strips x and y + k kStrip, k < kAtOnce: the sums of several pairs run beside
/// each other, where one alone would wait for itself.
template <size_t kAtOnce>
void add_products(const float* x, const float* y, double* to) {
  // An array of arrays of lanes would be kept in memory.
  using Lanes = float __attribute__((vector_size(sizeof(float) * kLanes)));
  const auto load = [](const float* from) {
    Lanes lanes;
    std::memcpy(&lanes, from, sizeof lanes);
    return lanes;
  };
  std::array<Lanes, kAtOnce> sums{};
  for (size_t i = 0; i < kStrip; i += kLanes) {
    const Lanes own = load(x + i);
    for (size_t k = 0; k < kAtOnce; ++k) sums[k] += own * load(y + k * kStrip + i);
  }
  for (size_t k = 0; k < kAtOnce; ++k) to[k] += sum_of(sums[k]);
}

/// Weighted deviations of the batches over a strip, `kStrip` floats a batch, zero beyond `size`.
void add_gram(const std::vector<float>& deviations, size_t count, std::vector<double>* gram) {
  for (size_t b = 0; b < count; ++b) {
    const float* x = &deviations[b * kStrip];
    size_t c = b;
    for (; c + 4 <= count; c += 4) add_products<4>(x, &deviations[c * kStrip], &(*gram)[b * count + c]);
    for (; c < count; ++c) add_products<1>(x, &deviations[c * kStrip], &(*gram)[b * count + c]);
  }
}

/// Adds the values [begin, end) of the band.
void add_batch_sums(std::span<const float* const> sums, const Band& band, size_t begin, size_t end,
                    double to_mean, Sums* result) {
  const size_t count = sums.size();
  const auto n = static_cast<double>(count);
  const Neighbourhood& near = band.near.square.empty() ? band.around : band.near;
  std::vector<float>& deviations = result->deviations;
  std::array<double, kStrip> terms{}, near_root;
  const double unbias = n / (n - 1), to_rest = 1 / (n - 1),
               to_others = count > 2 ? 1 / ((n - 2) * (n - 1)) : 0;
  for (; begin < end; begin += kStrip) {
    const size_t size = std::min(kStrip, end - begin);
    if (size < kStrip) {
      std::fill(deviations.begin(), deviations.end(), 0.0f);
      terms.fill(0);
    }
    const float* mean = &band.mean[begin];
    const float* variance = &band.variance[begin];
    const float* square = &band.around.square[begin];
    const float* noise = &band.around.noise[begin];
    const float* near_square = &near.square[begin];
    const float* near_noise = &near.noise[begin];
    // The same for all batches.
    for (size_t i = 0; i < size; ++i)
      near_root[i] = std::sqrt(blended_weight(mean[i], variance[i], 1, near_square[i], near_noise[i]));
    for (size_t b = 0; b < count; ++b) {
      const float* sum = sums[b] + band.first + begin;
      for (size_t i = 0; i < size; ++i) {
        const double m = mean[i], t = variance[i];
        const double deviation = static_cast<double>(sum[i]) * to_mean - m;
        const double single = deviation * deviation * unbias;
        // The others' mean and its variance; of one other batch there is none.
        const double rest = count > 2 ? m - deviation * to_rest : m;
        const double rest_t = count > 2 ? std::max(0.0, t * n * (n - 1) - single) * to_others : t;
        const double stretch = count > 2 ? 1 + 2 / n : 1;
        terms[i] = single * blended_weight(rest, rest_t, stretch, square[i], noise[i]);
        deviations[b * kStrip + i] = static_cast<float>(deviation * near_root[i]);
      }
      std::array<double, kLanes> lanes{};
      for (size_t i = 0; i < kStrip; i += kLanes) {
        for (size_t k = 0; k < kLanes; ++k) lanes[k] += terms[i + k];
      }
      result->d[b] += sum_of(lanes);
    }
    add_gram(deviations, count, &result->gram);
  }
}

}  // namespace

// Band by band, as memory for whole images, new for every estimate, costs more than the estimate.
BatchMoments batch_moments(std::span<const float* const> sums, const PixelLayout& layout, double to_mean) {
  const size_t row = 3 * layout.width, halo = std::max(layout.reach.rows, layout.near.rows),
               rows = std::max(kBandValues / row + 1, 16 * halo);
  const bool two_reaches = sums.size() >= kMinIntervalBatches && layout.near != layout.reach;
  Sums result(sums.size());
  Band band;
  for (size_t y = 0; y < layout.rows; y += rows) {
    const size_t top = y - std::min(y, halo), end = std::min(layout.rows, y + rows);
    const PixelLayout part{layout.width, std::min(layout.rows, end + halo) - top};
    band.first = top * row;
    find_mean(sums, part.rows * row, to_mean, &band);
    neighbourhood(band.mean, band.variance, part, layout.reach, &band.around);
    if (two_reaches) neighbourhood(band.mean, band.variance, part, layout.near, &band.near);
    add_batch_sums(sums, band, (y - top) * row, (end - top) * row, to_mean, &result);
  }
  const auto values = static_cast<double>(row * layout.rows);
  for (double& v : result.d) v /= values;
  for (double& v : result.gram) v /= values;
  return result;
}

}  // namespace lightmill
