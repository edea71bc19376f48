#include "common/image/denoise/patches.h"

#include <algorithm>
#include <cmath>

namespace lightmill::denoise {

namespace {

constexpr int kPatchNoiseRadius = 2;   // around which noise is taken to be alike
constexpr float kLeastColour = 1e-3f;  // below which differences are not seen
constexpr int kBandRows = 32;          // that a thread takes at a time: what it sums stays in its cache

/// What both halves' distances are over.
struct PatchScales {
  Colour variance;                       // of a half of the guide
  Colour invisible;                      // square of the difference that is not seen in a guide without noise
  std::array<Plane, kFeatures> feature;  // 1 over the square of a feature's width
};

PatchScales scales_of(const Extent& extent, const Features& features, const Halves& guide,
                      const PatchOptions& options, int threads) {
  PatchScales scales{Colour(extent.pixels()), Colour(extent.pixels()), {}};
  for (Plane& plane : scales.feature) plane.resize(extent.pixels());
  for_rows(extent, threads, [&](int y) {
    const size_t begin = extent.at(0, y), end = begin + static_cast<size_t>(extent.width);
    for (int c = 0; c < 3; ++c) {
      const Plane &a = guide.of[0].c[c], &b = guide.of[1].c[c];
      for (size_t i = begin; i < end; ++i) {
        const float d = a[i] - b[i];
        const float size = options.colour_width * 0.5f * (a[i] + b[i]);
        scales.variance.c[c][i] = 0.5f * d * d;
        scales.invisible.c[c][i] = size * size + kLeastColour * kLeastColour;
      }
    }
    const float square = options.feature_width * options.feature_width;
    for (size_t k = 0; k < kFeatures; ++k) {
      for (size_t i = begin; i < end; ++i) scales.feature[k][i] = 1 / (square + 8 * features.variance[k][i]);
    }
  });
  for (Plane& variance : scales.variance.c) box_mean(extent, kPatchNoiseRadius, threads, &variance);
  return scales;
}

/// Some rows, compared with what lies at one offset after the other.
class PatchBand {
 public:
  PatchBand(const Extent& extent, const Features& features, const PatchScales& scales, const Halves& halves,
            const Halves& guide, const PatchOptions& options, int begin, int end, Halves* result)
      : extent_(extent),
        features_(features),
        scales_(scales),
        halves_(halves),
        guide_(guide),
        options_(options),
        begin_(begin),
        end_(end),
        width_(static_cast<size_t>(extent.width)),
        result_(*result) {
    const auto rows = static_cast<size_t>(end - begin);
    for (int h = 0; h < 2; ++h) {
      distance_[h].resize((rows + 2 * static_cast<size_t>(options.patch_radius)) * width_);
      total_[h].resize(rows * width_);
    }
    column_.resize(width_);
    weight_.resize(width_);
  }

  void filter(const DenoiseOptions& how) {
    for (int dy = -options_.radius; dy <= options_.radius; ++dy) {
      if (how.stop.stop_requested()) throw DenoiseStopped();
      for (int dx = -options_.radius; dx <= options_.radius; ++dx) add(dx, dy);
    }
    for (int y = begin_; y < end_; ++y) {
      for (int h = 0; h < 2; ++h) {
        const float* total = &total_[h][static_cast<size_t>(y - begin_) * width_];
        for (Plane& plane : result_.of[h].c) {
          float* to = &plane[extent_.at(0, y)];
          for (size_t x = 0; x < width_; ++x) to[x] /= total[x];
        }
      }
    }
  }

 private:
  /// Columns and the offset to their others; both are in the picture.
  struct Shift {
    int x0, x1;
    std::ptrdiff_t offset;
  };

  float* distance(int h, int y) {
    return &distance_[h][static_cast<size_t>(y - begin_ + options_.patch_radius) * width_];
  }

  void add(int dx, int dy) {
    const int p = options_.patch_radius, height = extent_.height;
    const Shift shift{std::max(0, -dx), std::min(extent_.width, extent_.width - dx),
                      static_cast<std::ptrdiff_t>(dy) * extent_.width + dx};
    const int y0 = std::max(begin_, -dy), y1 = std::min(end_, height - dy);
    if (shift.x0 >= shift.x1 || y0 >= y1) return;
    // Patches end where they, or their others, leave the picture.
    const int top = std::max({0, -dy, y0 - p}), bottom = std::min({height, height - dy, y1 + p});
    for (int y = top; y < bottom; ++y) compare(y, shift);
    for (int y = y0; y < y1; ++y) {
      for (int h = 0; h < 2; ++h) {
        mean_over_patch(h, std::max(top, y - p), std::min(bottom, y + p + 1), shift);
        add_features(h, y, shift);
        accumulate(h, y, shift);
      }
    }
  }

  /// Squared distances of single pixels of a row from their others, less what noise alone would make them.
  void compare(int y, const Shift& shift) {
    const size_t row = extent_.at(0, y);
    for (int h = 0; h < 2; ++h) std::fill_n(distance(h, y), width_, 0.0f);
    const float noise = options_.noise * options_.noise;
    for (int c = 0; c < 3; ++c) {
      const float *const v = &scales_.variance.c[c][row], *const least = &scales_.invisible.c[c][row];
      const float* const u = v + shift.offset;
      float *const expected = column_.data(), *const scale = weight_.data();
      for (int x = shift.x0; x < shift.x1; ++x) {
        const float own = v[x], other = u[x];
        expected[x] = own + std::min(own, other);
        scale[x] = 1 / (3 * (least[x] + noise * (own + other)));
      }
      for (int h = 0; h < 2; ++h) {
        const float* const f = &guide_.of[h].c[c][row];
        const float* const g = f + shift.offset;
        float* const to = distance(h, y);
        for (int x = shift.x0; x < shift.x1; ++x) {
          const float d = f[x] - g[x];
          to[x] += scale[x] * (d * d - expected[x]);
        }
      }
    }
  }

  /// Into weight_: the mean of the distances over rows [v0, v1) and as many columns.
  void mean_over_patch(int h, int v0, int v1, const Shift& shift) {
    const int p = options_.patch_radius;
    std::copy_n(distance(h, v0), width_, column_.begin());
    for (int v = v0 + 1; v < v1; ++v) {
      const float* d = distance(h, v);
      for (size_t x = 0; x < width_; ++x) column_[x] += d[x];
    }
    const float* column = column_.data();
    float* to = weight_.data();
    const auto rows = static_cast<float>(v1 - v0);
    const int inner0 = std::min(shift.x1, shift.x0 + p), inner1 = std::max(inner0, shift.x1 - p);
    const auto at_border = [&](int x) {
      const int u0 = std::max(shift.x0, x - p), u1 = std::min(shift.x1, x + p + 1);
      float sum = 0;
      for (int u = u0; u < u1; ++u) sum += column[u];
      to[x] = std::max(0.0f, sum / (rows * static_cast<float>(u1 - u0)));
    };
    for (int x = shift.x0; x < inner0; ++x) at_border(x);
    for (int x = inner1; x < shift.x1; ++x) at_border(x);
    std::copy(column + inner0, column + inner1, to + inner0);
    for (int k = 1; k <= p; ++k) {
      for (int x = inner0; x < inner1; ++x) to[x] += column[x - k] + column[x + k];
    }
    const float scale = 1 / (rows * static_cast<float>(2 * p + 1));
    for (int x = inner0; x < inner1; ++x) to[x] = std::max(0.0f, scale * to[x]);
  }

  void add_features(int h, int y, const Shift& shift) {
    const size_t row = extent_.at(0, y);
    float* to = weight_.data();
    for (size_t k = 0; k < kFeatures; ++k) {
      const float* f = &features_.of[h][k][row];
      const float* scale = &scales_.feature[k][row];
      const float* g = f + shift.offset;
      for (int x = shift.x0; x < shift.x1; ++x) to[x] += scale[x] * (f[x] - g[x]) * (f[x] - g[x]);
    }
  }

  /// Weights are (1 - d / 4)^4, which is nearly exp(-d) but ends at 4.
  void accumulate(int h, int y, const Shift& shift) {
    float* weight = weight_.data();
    float* total = &total_[h][static_cast<size_t>(y - begin_) * width_];
    for (int x = shift.x0; x < shift.x1; ++x) {
      const float near = std::max(0.0f, 1 - weight[x] * (1.0f / 4)), square = near * near;
      weight[x] = square * square;
      total[x] += weight[x];
    }
    const size_t row = extent_.at(0, y);
    for (int c = 0; c < 3; ++c) {
      const float* f = &halves_.of[h].c[c][row] + shift.offset;
      float* sum = &result_.of[h].c[c][row];
      for (int x = shift.x0; x < shift.x1; ++x) sum[x] += weight[x] * f[x];
    }
  }

  const Extent extent_;
  const Features& features_;
  const PatchScales& scales_;
  const Halves &halves_, &guide_;
  const PatchOptions options_;
  const int begin_, end_;
  const size_t width_;
  Halves& result_;
  Plane distance_[2], total_[2];  // rows of the band; `distance_` has those of the patches around it, too
  Plane column_, weight_;         // a row
};

}  // namespace

Halves patch_means(const Extent& extent, const Features& features, const Halves& halves, const Halves& guide,
                   const PatchOptions& options, const DenoiseOptions& how) {
  const PatchScales scales = scales_of(extent, features, guide, options, how.threads);
  Halves result(extent.pixels());
  const auto bands = static_cast<size_t>((extent.height + kBandRows - 1) / kBandRows);
  parallel_for(bands, how.threads, [&](size_t band) {
    const int begin = static_cast<int>(band) * kBandRows, end = std::min(begin + kBandRows, extent.height);
    PatchBand(extent, features, scales, halves, guide, options, begin, end, &result).filter(how);
  });
  return result;
}

}  // namespace lightmill::denoise
