#pragma once
// The pixels whose sums are kept for the error estimate: all of a small film. Of a large one a fixed
// pseudo-random subset of boxes of 4x4 pixels, spread evenly, and besides the sums over all boxes of 16x16.
// In a film that is too narrow for such boxes, 16 pixels that follow one another stand for one.
#include <cstdint>
#include <vector>

#include "common/error/batch_moments.h"
#include "common/film/exact_sum.h"
#include "common/image/image.h"
#include "common/job/pixel_interleave.h"

namespace lightmill {

/// What is kept of one batch: 3 values per pixel or box, sums over samples and pixels.
struct TrackedSums {
  std::vector<float> pixels;
  std::vector<float> boxes;  // of a film whose pixels are not all tracked
  TrackedSums& operator+=(const TrackedSums& o);
};

class TrackedPixels {
 public:
  static constexpr int64_t kMost = 262144;
  static constexpr int kSide = 4,
                       kBoxSide = 16;  // of the boxes whose pixels are tracked, and of those summed

  TrackedPixels() = default;
  explicit TrackedPixels(const FilmGrid& grid);
  bool all() const { return chosen_.empty(); }
  int64_t count() const { return count_; }
  TrackedSums empty_sums() const;
  /// Index in the crop window of tracked pixel number `at`.
  int64_t pixel(int64_t at) const;
  /// How the tracked pixels lie beside each other.
  PixelLayout layout() const;

  /// Adds the sums `from` of the pixels of `r`, row-major in packet order, in units of `unit`.
  void add_camera(const PixelRect& r, const ExactRgb* from, double unit, TrackedSums* to) const;
  /// Adds the sum of a pixel, given by its index in the crop window. `hint` is 0 at first, and pixels ascend.
  void add_splat(int64_t pixel, const ExactRgb& sum, double unit, size_t* hint, TrackedSums* to) const;

  /// Sums over whole boxes of `side` x `side` pixels, kBoxSides only, and how they lie beside each other: no
  /// width or rows if none fits.
  std::vector<float> box_sums(const TrackedSums& sums, int side) const;
  PixelLayout box_layout(int side) const;

 private:
  struct Place {
    uint32_t pixel, at;  // index in the crop window; number among the tracked pixels
  };
  int columns() const { return grid_.crop.width(); }
  int rows() const { return grid_.crop.height(); }
  bool too_narrow() const { return columns() < kSide || rows() < kSide; }
  /// (x, y) within the crop window.
  void add_to_box(int x, int y, const ExactRgb& sum, double unit, float* boxes) const;

  FilmGrid grid_;
  PixelInterleave interleave_;
  int64_t count_ = 0;
  std::vector<int64_t> chosen_;  // numbers of the boxes, row-major, ascending; empty: all pixels
  std::vector<Place> in_packets_,
      in_film_;  // of the tracked pixels, ascending in packet order and in film order
};

}  // namespace lightmill
