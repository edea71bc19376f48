#include "common/image/denoise/regression.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lightmill::denoise {

namespace {

constexpr int kTerms = kFeatures + 1;  // with the constant
using Terms = float __attribute__((vector_size(sizeof(float) * kTerms)));

/// What the sums over a window need of a pixel, beside each other.
struct PixelTerms {
  Terms terms[2];  // of each half: 1, then the features
  float colour[2][4];
};

/// A normal matrix and its three right sides.
struct Moments {
  Terms matrix[kTerms] = {};
  Terms right[3] = {};

  void add(float weight, const Terms& terms, const float* colour) {
    const Terms weighted = terms * weight;
    for (int i = 0; i < kTerms; ++i) matrix[i] += weighted * terms[i];
    for (int c = 0; c < 3; ++c) right[c] += weighted * colour[c];
  }
};

/// Solves the system in place by Cholesky's method: right[c] becomes the coefficients.
void solve(Moments* moments) {
  float l[kTerms][kTerms];
  for (int i = 0; i < kTerms; ++i) {
    for (int j = 0; j <= i; ++j) {
      float sum = moments->matrix[i][j];
      for (int k = 0; k < j; ++k) sum -= l[i][k] * l[j][k];
      // What rounding leaves of a feature that depends on others: none of it is used.
      l[i][j] = i == j ? std::sqrt(std::max(sum, 1e-6f * moments->matrix[i][i] + 1e-20f)) : sum / l[j][j];
    }
  }
  for (Terms& right : moments->right) {
    for (int i = 0; i < kTerms; ++i) {
      float sum = right[i];
      for (int k = 0; k < i; ++k) sum -= l[i][k] * right[k];
      right[i] = sum / l[i][i];
    }
    for (int i = kTerms - 1; i >= 0; --i) {
      float sum = right[i];
      for (int k = i + 1; k < kTerms; ++k) sum -= l[k][i] * right[k];
      right[i] = sum / l[i][i];
    }
  }
}

struct Window {
  int x0, x1, y0, y1;
  int width() const { return x1 - x0; }
  int height() const { return y1 - y0; }
};

class Regression {
 public:
  Regression(const Extent& extent, const Features& features, const Halves& halves,
             const RegressionOptions& options, int threads)
      : extent_(extent), features_(features), options_(options), pixels_(extent.pixels()) {
    for_rows(extent, threads, [&](int y) {
      for (size_t i = extent.at(0, y); i < extent.at(0, y) + static_cast<size_t>(extent.width); ++i) {
        PixelTerms& pixel = pixels_[i];
        for (int h = 0; h < 2; ++h) {
          pixel.terms[h][0] = 1;
          for (int k = 0; k < kFeatures; ++k)
            pixel.terms[h][k + 1] = features.of[h][static_cast<size_t>(k)][i];
          for (int c = 0; c < 3; ++c) pixel.colour[h][c] = halves.of[h].c[c][i];
          pixel.colour[h][3] = 0;
        }
      }
    });
    sums_ = Halves(extent.pixels());
    for (Plane& weights : weights_) weights.resize(extent.pixels());
  }

  Halves run(const DenoiseOptions& how) {
    const int threads = how.threads;
    // Bands of rows of centres. Their windows overlap those of the next band only: so first the even ones,
    // then the odd ones, and every pixel's sum has one order.
    const int band =
        std::max(4 * options_.stride, (2 * options_.radius / options_.stride + 1) * options_.stride);
    const int bands = (extent_.height + band - 1) / band;
    for (int odd = 0; odd < 2; ++odd) {
      parallel_for(static_cast<size_t>((bands - odd + 1) / 2), threads, [&](size_t i) {
        const int y0 = (2 * static_cast<int>(i) + odd) * band;
        for (int y = y0; y < std::min(y0 + band, extent_.height); y += options_.stride) {
          if (how.stop.stop_requested()) throw DenoiseStopped();
          for (int x = 0; x < extent_.width; x += options_.stride) fit(x, y);
        }
      });
    }
    for_rows(extent_, threads, [&](int y) {
      const size_t begin = extent_.at(0, y), end = begin + static_cast<size_t>(extent_.width);
      for (int h = 0; h < 2; ++h) {
        for (int c = 0; c < 3; ++c) {
          // Where no model fits, the pixel's own value.
          for (size_t i = begin; i < end; ++i) {
            const float value = pixels_[i].colour[h][c];
            sums_.of[h].c[c][i] = (sums_.of[h].c[c][i] + kOwnWeight * value) / (weights_[h][i] + kOwnWeight);
          }
        }
      }
    });
    return std::move(sums_);
  }

 private:
  static constexpr float kOwnWeight = 1e-2f;
  static constexpr int kMaxSide = 64;

  /// Weights of a row of the window. Falls as (1 - d / 6)^3, which is nearly exp(-d / 2) but ends at 6.
  void weigh_row(int x, int y, const Window& window, int v, float* const weights[2]) const {
    const size_t centre = extent_.at(x, y), row = extent_.at(window.x0, v);
    const int n = window.width();
    const float square = options_.feature_width * options_.feature_width;
    for (int h = 0; h < 2; ++h) {
      float sum[kMaxSide] = {};
      for (size_t k = 0; k < kFeatures; ++k) {
        const float own = features_.of[h][k][centre];
        const float* value = &features_.of[h][k][row];
        const float factor = 1 / (square + 8 * features_.variance[k][centre]);
        for (int i = 0; i < n; ++i) sum[i] += factor * (value[i] - own) * (value[i] - own);
      }
      const float dy = static_cast<float>(v - y) / static_cast<float>(options_.radius + 1);
      for (int i = 0; i < n; ++i) {
        const float dx = static_cast<float>(window.x0 + i - x) / static_cast<float>(options_.radius + 1);
        const float near = std::max(0.0f, 1 - sum[i] * (1.0f / 6));
        weights[h][i] = near * near * near * std::max(0.0f, 1 - dx * dx) * (1 - dy * dy);
      }
    }
  }

  /// Rows are whole vectors where the picture is as wide. What lies beyond the radius has weight 0.
  Window window_around(int x, int y) const {
    constexpr int kLanes = 8;
    const int r = options_.radius;
    Window window{std::max(0, x - r), std::min(extent_.width, x + r + 1), std::max(0, y - r),
                  std::min(extent_.height, y + r + 1)};
    const int width = (window.width() + kLanes - 1) / kLanes * kLanes;
    if (width <= extent_.width) {
      window.x1 = std::min(extent_.width, window.x0 + width);
      window.x0 = window.x1 - width;
    }
    return window;
  }

  void fit(int x, int y) {
    const Window window = window_around(x, y);
    float weights[2][kMaxSide * kMaxSide];
    for (int v = window.y0; v < window.y1; ++v) {
      const int first = (v - window.y0) * window.width();
      float* const row[2] = {weights[0] + first, weights[1] + first};
      weigh_row(x, y, window, v, row);
    }
    for (int h = 0; h < 2; ++h) {
      Moments sum;
      Terms origin = pixels_[extent_.at(x, y)].terms[h];
      origin[0] = 0;
      const float* weight = weights[h];
      for (int v = window.y0; v < window.y1; ++v) {
        const PixelTerms* pixel = &pixels_[extent_.at(window.x0, v)];
        for (int i = 0; i < window.width(); ++i, ++weight) {
          if (*weight > 0) sum.add(*weight, pixel[i].terms[h] - origin, pixel[i].colour[h]);
        }
      }
      const float total = sum.matrix[0][0];
      for (int k = 1; k < kTerms; ++k) {
        const float noise = features_.variance[static_cast<size_t>(k - 1)][extent_.at(x, y)];
        sum.matrix[k][k] += total * (options_.ridge + noise);
      }
      solve(&sum);
      predict(window, origin, sum, weights[h], h);
    }
  }

  /// Adds what the model says of the window's pixels.
  void predict(const Window& window, const Terms& origin, const Moments& model, const float* weights, int h) {
    for (int v = window.y0; v < window.y1; ++v, weights += window.width()) {
      const size_t row = extent_.at(window.x0, v);
      const int n = window.width();
      for (int c = 0; c < 3; ++c) {
        float value[kMaxSide];
        std::fill_n(value, n, model.right[c][0]);
        for (int k = 1; k < kTerms; ++k) {
          const float* feature = &features_.of[h][static_cast<size_t>(k - 1)][row];
          const float slope = model.right[c][k], from = origin[k];
          for (int i = 0; i < n; ++i) value[i] += slope * (feature[i] - from);
        }
        float* to = &sums_.of[h].c[c][row];
        for (int i = 0; i < n; ++i) to[i] += weights[i] * value[i];
      }
      float* total = &weights_[h][row];
      for (int i = 0; i < n; ++i) total[i] += weights[i];
    }
  }

  const Extent extent_;
  const Features& features_;
  const RegressionOptions options_;
  std::vector<PixelTerms> pixels_;
  Halves sums_;
  Plane weights_[2];
};

}  // namespace

Halves regress(const Extent& extent, const Features& features, const Halves& halves,
               const RegressionOptions& options, const DenoiseOptions& how) {
  return Regression(extent, features, halves, options, how.threads).run(how);
}

}  // namespace lightmill::denoise
