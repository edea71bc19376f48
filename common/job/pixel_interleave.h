#pragma once
// Where a packet's pixels lie in the image: interleaved sampling (Keller & Heidrich, "Interleaved Sampling",
// 2001).
//
// The pixels of a packet share light paths, so their errors go together. If they lay beside each other, the
// error would show as a square. So 8x8 packets or more (fewer in small films) are interleaved: every patch of
// 8x8 pixels has one pixel of each of them. Which one it is changes from patch to patch, so no grid shows.
//
// Tiles, partials and sums are in *packet order*, in which a packet is a cell of 32x32 pixels. Camera rays,
// splats, regions and images are in *film order*. One is a permutation of the other within the crop window.
// It depends on the film's grid alone. In jobs that an older version began (FilmGrid::interleaved) the orders
// are the same.
//
//   const PixelInterleave interleave(grid);
//   FilmPixel p = interleave.to_film(x, y);   // (x, y) in packet order
#include <cstdint>
#include <vector>

#include "common/job/packet_grid.h"

namespace lightmill {

/// Least number of cells that are interleaved, on each axis, if the crop window has as many.
inline constexpr int kInterleavedCells = 8;

struct FilmPixel {
  int x = 0, y = 0;
  bool operator==(const FilmPixel&) const = default;
};

class PixelInterleave {
 public:
  PixelInterleave() = default;
  explicit PixelInterleave(const FilmGrid& grid);
  /// The place in the image of pixel (x, y) in packet order. Both lie in the crop window.
  FilmPixel to_film(int x, int y) const;
  /// Index of that place in the row-major crop window.
  int64_t film_index(int x, int y) const;
  /// The inverse: of a pixel of the image, its place in packet order.
  FilmPixel to_packet(int x, int y) const;

 private:
  /// One axis of the film. Entries belong to the pixels from `begin` on.
  struct Axis {
    int begin = 0;
    std::vector<int> to_film, to_packet;       // before patches are shifted
    std::vector<int> patch_begin, patch_size;  // of the patch that a pixel of the image lies in
    Axis() = default;
    Axis(int begin, int end, bool interleaved);
  };
  static int shifted(const Axis& axis, int at, int shift);

  Axis x_, y_;
};

}  // namespace lightmill
