#pragma once
// Indices of pixels in the crop window, one after the other: it divides once for a row of pixels, not for
// each.
#include <cstdint>

#include "common/job/packet_grid.h"

namespace lightmill {

class CropWalk {
 public:
  /// `grid` must outlive the walk.
  explicit CropWalk(const FilmGrid& grid) : grid_(grid) {}
  /// grid.crop_index(pixel), quickly if the last pixel lay in the same row.
  int64_t operator()(uint32_t pixel) {
    const uint32_t column = pixel - row_begin_;
    return column < row_pixels_ ? row_index_ + column : seek(pixel);
  }

 private:
  int64_t seek(uint32_t pixel) {
    const int64_t index = grid_.crop_index(pixel);
    if (index < 0) return index;
    const int64_t column = index % grid_.crop.width();
    row_begin_ = pixel - static_cast<uint32_t>(column);
    row_pixels_ = static_cast<uint32_t>(grid_.crop.width());
    row_index_ = index - column;
    return index;
  }

  const FilmGrid& grid_;
  uint32_t row_begin_ = 0, row_pixels_ = 0;  // of the crop window's part of a row; none yet
  int64_t row_index_ = 0;                    // of its first pixel in the crop window
};

}  // namespace lightmill
