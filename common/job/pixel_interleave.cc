#include "common/job/pixel_interleave.h"

#include <algorithm>

#include "common/base/split_mix.h"

namespace lightmill {
namespace {

/// Shifts of the patch that begins at (x, y): two numbers of 16 bits.
struct Shift {
  uint32_t x, y;
};
Shift shift_of_patch(int x, int y) {
  const uint64_t h =
      split_mix(static_cast<uint64_t>(static_cast<uint32_t>(x)) << 32 | static_cast<uint32_t>(y));
  return {static_cast<uint32_t>(h & 0xffff), static_cast<uint32_t>(h >> 16 & 0xffff)};
}

}  // namespace

PixelInterleave::Axis::Axis(int begin_, int end, bool interleaved) : begin(begin_) {
  const auto index = [&](int i) { return static_cast<size_t>(i - begin); };
  for (std::vector<int>* v : {&to_film, &to_packet, &patch_begin, &patch_size}) v->resize(index(end));
  const int first_cell = begin / kCellSize, all_cells = (end + kCellSize - 1) / kCellSize - first_cell;
  const int groups = interleaved ? std::max(1, all_cells / kInterleavedCells) : all_cells;
  for (int g = 0; g < groups; ++g) {
    // The group's cells, and its pixels, which are the same in both orders.
    const int begin_cell = first_cell + all_cells * g / groups,
              end_cell = first_cell + all_cells * (g + 1) / groups;
    const int first = std::max(begin_cell * kCellSize, begin), last = std::min(end_cell * kCellSize, end);
    struct Place {
      int number, pixels;  // pixel `number` of the `pixels` of its cell
      int at;
    };
    std::vector<Place> places;
    for (int cell = begin_cell; cell < end_cell; ++cell) {
      const int from = std::max(cell * kCellSize, begin), to = std::min((cell + 1) * kCellSize, end);
      for (int at = from; at < to; ++at) places.push_back({at - from, to - from, at});
    }
    // Each cell's pixels are spread evenly: by where they stand within it.
    std::stable_sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
      return (2 * a.number + 1) * b.pixels < (2 * b.number + 1) * a.pixels;
    });
    const int cells = end_cell - begin_cell;
    for (int i = 0; i < last - first; ++i) {
      const int packet = places[static_cast<size_t>(i)].at, film = first + i;
      to_film[index(packet)] = film;
      to_packet[index(film)] = packet;
      const int patch = first + i / cells * cells;
      patch_begin[index(film)] = patch;
      patch_size[index(film)] = std::min(cells, last - patch);
    }
  }
}

PixelInterleave::PixelInterleave(const FilmGrid& grid)
    : x_(grid.crop.x0, grid.crop.x1, grid.interleaved), y_(grid.crop.y0, grid.crop.y1, grid.interleaved) {}

int PixelInterleave::shifted(const Axis& axis, int at, int shift) {
  const auto i = static_cast<size_t>(at - axis.begin);
  const int first = axis.patch_begin[i], size = axis.patch_size[i];
  return first + (at - first + shift) % size;
}

FilmPixel PixelInterleave::to_film(int x, int y) const {
  const int fx = x_.to_film[static_cast<size_t>(x - x_.begin)],
            fy = y_.to_film[static_cast<size_t>(y - y_.begin)];
  const Shift shift = shift_of_patch(x_.patch_begin[static_cast<size_t>(fx - x_.begin)],
                                     y_.patch_begin[static_cast<size_t>(fy - y_.begin)]);
  return {shifted(x_, fx, static_cast<int>(shift.x)), shifted(y_, fy, static_cast<int>(shift.y))};
}

int64_t PixelInterleave::film_index(int x, int y) const {
  const FilmPixel p = to_film(x, y);
  return int64_t{p.y - y_.begin} * static_cast<int64_t>(x_.to_film.size()) + p.x - x_.begin;
}

FilmPixel PixelInterleave::to_packet(int x, int y) const {
  const auto ix = static_cast<size_t>(x - x_.begin), iy = static_cast<size_t>(y - y_.begin);
  const Shift shift = shift_of_patch(x_.patch_begin[ix], y_.patch_begin[iy]);
  const int sx = x_.patch_size[ix], sy = y_.patch_size[iy];
  const int fx = shifted(x_, x, sx - static_cast<int>(shift.x) % sx),
            fy = shifted(y_, y, sy - static_cast<int>(shift.y) % sy);
  return {x_.to_packet[static_cast<size_t>(fx - x_.begin)], y_.to_packet[static_cast<size_t>(fy - y_.begin)]};
}

}  // namespace lightmill
