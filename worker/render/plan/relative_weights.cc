#include "worker/render/plan/relative_weights.h"

namespace lightmill {
namespace {

/// A picture with a larger mean value is shown with an exposure that brings the mean to kShownMean.
constexpr float kBrightPicture = 2, kShownMean = 0.3f;

}  // namespace

RelativeWeights::RelativeWeights(const FilmGrid& grid, double paths_per_pixel, double paths)
    : paths_per_pixel_(static_cast<float>(paths_per_pixel)) {
  const CellRect cells = grid.cells();
  grid_ = {1, cells.x0 * kCellSize, cells.y0 * kCellSize, cells.width() * kCellSize,
           cells.height() * kCellSize};
  const auto too_fine = [&] {
    return grid_.count() > kMostSquares || paths_per_pixel * grid_.side * grid_.side < paths;
  };
  while (too_fine() && (grid_.columns > 1 || grid_.rows > 1)) {
    grid_.side *= 2;
    grid_.columns = (grid_.columns + 1) / 2;
    grid_.rows = (grid_.rows + 1) / 2;
  }
  squares_.resize(static_cast<size_t>(grid_.count()));
}

void RelativeWeights::add_camera(int x, int y, const Channels& rgb) {
  Square& square = squares_[at(x, y)];
  for (size_t ch = 0; ch < 3; ++ch) square.camera[ch] += rgb[ch];
}
void RelativeWeights::add_splat(int x, int y, const Channels& rgb) {
  Square& square = squares_[at(x, y)];
  for (size_t ch = 0; ch < 3; ++ch) square.splats[ch] += rgb[ch] * per_splat_;
}

void RelativeWeights::finish() {
  for (const Square& s : squares_) {
    for (size_t ch = 0; ch < 3; ++ch) all_.camera[ch] += s.camera[ch], all_.splats[ch] += s.splats[ch];
    all_.pixels += s.pixels;
  }
  const float picture = (value(all_, 0) + value(all_, 1) + value(all_, 2)) / 3;
  if (picture > kBrightPicture) epsilon_ *= (picture / kShownMean) * (picture / kShownMean);
  for (int row = 0; row < grid_.rows; ++row) {
    for (int column = 0; column < grid_.columns; ++column) {
      const auto square = [&](int x, int y) -> Square& {
        return squares_[static_cast<size_t>(int64_t{y} * grid_.columns + x)];
      };
      for (size_t ch = 0; ch < 3; ++ch) {
        std::array<float, 9> around{};
        size_t count = 0;
        for (int y = std::max(row - 1, 0); y <= std::min(row + 1, grid_.rows - 1); ++y) {
          for (int x = std::max(column - 1, 0); x <= std::min(column + 1, grid_.columns - 1); ++x)
            around[count++] = value(square(x, y), ch);
        }
        const auto middle = around.begin() + static_cast<std::ptrdiff_t>(count / 2);
        std::nth_element(around.begin(), middle, around.begin() + static_cast<std::ptrdiff_t>(count));
        square(column, row).around[ch] = *middle;
      }
    }
  }
}

PixelValue RelativeWeights::of(int x, int y, const Channels& camera, float paths) const {
  PixelValue v = of(x, y);
  const Square& s = known(squares_[at(x, y)]);
  for (size_t ch = 0; ch < 3; ++ch) v.value[ch] = mean(s, s.splats[ch]) + camera[ch] / paths;
  v.camera_share = 1 / paths;
  return v;
}

PixelValue RelativeWeights::of(int x, int y) const {
  const Square& square = squares_[at(x, y)];
  PixelValue v;
  for (size_t ch = 0; ch < 3; ++ch) v.value[ch] = value(square, ch);
  v.around = square.around;
  v.epsilon = epsilon_;
  if (square.pixels > 0) {
    v.camera_share = 1 / (square.pixels * paths_per_pixel_);
    v.splat_share = v.emitter_share = per_splat_ * v.camera_share;
  }
  return v;
}

}  // namespace lightmill
