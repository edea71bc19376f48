#pragma once
// A picture that is known, with noise that is known: what denoisers are measured by in tests.
#include <cmath>
#include <random>
#include <vector>

#include "common/image/denoise/denoise.h"

namespace lightmill::testing {

struct NoisyPicture {
  DenoiseInput input;
  std::array<std::vector<float>, 3> truth;

  size_t pixels() const { return truth[0].size(); }
  /// The mean over pixels and channels of the squared difference from the truth, over truth^2 + 1e-2.
  double relmse(const std::array<std::vector<float>, 3>& colour) const {
    double sum = 0;
    for (size_t c = 0; c < 3; ++c) {
      for (size_t i = 0; i < pixels(); ++i) {
        const double t = truth[c][i], d = colour[c][i] - t;
        sum += d * d / (t * t + 1e-2);
      }
    }
    return sum / (3 * static_cast<double>(pixels()));
  }
};

/// A textured floor and a plain wall under light that falls off, with the edge of a shadow that no feature
/// shows.
inline void paint_room(int width, int height, NoisyPicture* picture) {
  DenoiseInput& in = picture->input;
  in.width = width, in.height = height;
  const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  for (size_t c = 0; c < 3; ++c) {
    picture->truth[c].resize(pixels);
    in.albedo[c].values.resize(pixels);
    in.normal[c].values.assign(pixels, 0.0f);
  }
  in.depth.values.resize(pixels);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto i = static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
      const bool floor = 3 * y > 2 * height;
      in.normal[floor ? 1 : 2].values[i] = 1;
      in.depth.values[i] = floor ? 4 - 3.0f * static_cast<float>(y) / static_cast<float>(height) : 2;
      const float light = (1.5f - static_cast<float>(x) / static_cast<float>(width)) *
                          (x + y < width / 2 ? 0.3f : 1.0f) * (floor ? 0.6f : 1);
      for (size_t c = 0; c < 3; ++c) {
        const float stripes = (x / 3 + y / 5) % 2 ? 0.7f : 0.2f;
        in.albedo[c].values[i] = floor ? stripes : 0.4f + 0.1f * static_cast<float>(c);
        picture->truth[c][i] = in.albedo[c].values[i] * light;
      }
    }
  }
}

/// Gives each half noise of `size` times the truth, of a mean over boxes of `blur` pixels a side.
inline void add_noise(double size, int blur, unsigned seed, NoisyPicture* picture) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  DenoiseInput& in = picture->input;
  const int width = in.width, height = in.height;
  const auto pixels = picture->pixels();
  for (size_t c = 0; c < 3; ++c) {
    std::vector<double> halves[2];
    for (std::vector<double>& half : halves) {
      std::vector<double> white(pixels);
      for (double& w : white) w = normal(random);
      half.resize(pixels);
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          double sum = 0;
          for (int v = y; v < y + blur; ++v) {
            for (int u = x; u < x + blur; ++u) {
              sum += white[static_cast<size_t>(v % height) * static_cast<size_t>(width) +
                           static_cast<size_t>(u % width)];
            }
          }
          const auto i = static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
          half[i] = static_cast<double>(picture->truth[c][i]) * (1 + size * sum / blur);
        }
      }
    }
    in.colour[c].resize(pixels);
    in.difference[c].resize(pixels);
    for (size_t i = 0; i < pixels; ++i) {
      in.colour[c][i] = static_cast<float>((halves[0][i] + halves[1][i]) / 2);
      in.difference[c][i] = static_cast<float>((halves[0][i] - halves[1][i]) / 2);
    }
  }
}

inline NoisyPicture noisy_room(int width, int height, double size, int blur = 1, unsigned seed = 1) {
  NoisyPicture picture;
  paint_room(width, height, &picture);
  add_noise(size, blur, seed, &picture);
  return picture;
}

}  // namespace lightmill::testing
