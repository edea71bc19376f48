#include "common/error/tracked_pixels.h"

#include <algorithm>

#include "common/base/split_mix.h"
#include "common/film/signed_sum.h"

namespace lightmill {

namespace {

constexpr int64_t kBoxPixels = int64_t{TrackedPixels::kSide} * TrackedPixels::kSide;

size_t index(int64_t i) { return static_cast<size_t>(i); }

/// from_signed_units(units, 0), without a call of ldexp for each, and quickly where 64 bits hold it.
double to_double(Units units) {
  const auto low = static_cast<int64_t>(units);
  if (units == static_cast<Units>(low)) return static_cast<double>(low);
  const Units size = magnitude(units);
  const double value = static_cast<double>(static_cast<uint64_t>(size >> 64)) * 0x1p64 +
                       static_cast<double>(static_cast<uint64_t>(size));
  return is_negative(units) ? -value : value;
}

/// Adds `sum`, in units of `unit`, to the three values from `rgb` on.
void add_sum(const ExactRgb& sum, double unit, float* rgb) {
  for (int c = 0; c < 3; ++c) rgb[c] += static_cast<float>(to_double(sum.c[c]) * unit);
}

/// Sums over the whole squares of `side` x `side` entries of an image of `columns` entries a row.
std::vector<float> sums_of_squares(const std::vector<float>& from, size_t columns, size_t side) {
  const size_t rows = from.size() / 3 / columns, width = columns / side, height = rows / side;
  std::vector<float> sums(3 * width * height);
  for (size_t y = 0; y < height * side; ++y) {
    float* to = &sums[3 * (y / side * width)];
    const float* row = &from[3 * y * columns];
    for (size_t x = 0; x < width * side; ++x) {
      for (size_t c = 0; c < 3; ++c) to[3 * (x / side) + c] += row[3 * x + c];
    }
  }
  return sums;
}

/// Sums over rows of `columns` entries.
std::vector<float> sums_of_rows(const std::vector<float>& from, size_t columns) {
  std::vector<float> sums(from.size() / columns);
  for (size_t i = 0; i < from.size(); ++i) sums[3 * (i / (3 * columns)) + i % 3] += from[i];
  return sums;
}

void add(const std::vector<float>& from, std::vector<float>* to) {
  for (size_t i = 0; i < from.size(); ++i) (*to)[i] += from[i];
}

}  // namespace

TrackedSums& TrackedSums::operator+=(const TrackedSums& o) {
  add(o.pixels, &pixels);
  add(o.boxes, &boxes);
  return *this;
}

TrackedPixels::TrackedPixels(const FilmGrid& grid) : grid_(grid), interleave_(grid) {
  const int64_t pixels = grid.crop.area(),
                boxes = too_narrow() ? pixels / kBoxPixels : int64_t{columns() / kSide} * (rows() / kSide);
  count_ = std::min(pixels, kMost);
  if (count_ == pixels) return;
  // One box of each of equal strata: the estimate looks at a pixel's neighbours.
  const int64_t strata = std::min(kMost / kBoxPixels, boxes);
  count_ = strata * kBoxPixels;
  chosen_.resize(index(strata));
  for (int64_t i = 0; i < strata; ++i) {
    const int64_t begin = i * boxes / strata, end = (i + 1) * boxes / strata;
    chosen_[index(i)] = begin + static_cast<int64_t>(split_mix(static_cast<uint64_t>(i)) %
                                                     static_cast<uint64_t>(end - begin));
  }
  const PixelRect& crop = grid.crop;
  for (int64_t at = 0; at < count_; ++at) {
    const int64_t own = pixel(at);
    const FilmPixel p = interleave_.to_packet(crop.x0 + static_cast<int>(own % columns()),
                                              crop.y0 + static_cast<int>(own / columns()));
    in_film_.push_back({static_cast<uint32_t>(own), static_cast<uint32_t>(at)});
    in_packets_.push_back({static_cast<uint32_t>(int64_t{p.y - crop.y0} * columns() + p.x - crop.x0),
                           static_cast<uint32_t>(at)});
  }
  for (std::vector<Place>* places : {&in_film_, &in_packets_})
    std::sort(places->begin(), places->end(),
              [](const Place& a, const Place& b) { return a.pixel < b.pixel; });
}

TrackedSums TrackedPixels::empty_sums() const {
  TrackedSums sums;
  sums.pixels.resize(3 * index(count_));
  if (!all()) sums.boxes.resize(3 * index(int64_t{columns() / kBoxSide} * (rows() / kBoxSide)));
  return sums;
}

int64_t TrackedPixels::pixel(int64_t at) const {
  if (all()) return at;
  const int64_t box = chosen_[index(at / kBoxPixels)], across = columns() / kSide;
  if (too_narrow()) return box * kBoxPixels + at % kBoxPixels;
  const int64_t x = box % across * kSide + at % kBoxPixels % kSide,
                y = box / across * kSide + at % kBoxPixels / kSide;
  return y * columns() + x;
}

PixelLayout TrackedPixels::layout() const {
  if (all()) return {index(columns()), index(rows())};
  // The pixels of a box are one row: all others of it are around each.
  return {index(kBoxPixels), chosen_.size(), {index(kBoxPixels) - 1, 0}, {index(kBoxPixels) - 1, 0}};
}

void TrackedPixels::add_to_box(int x, int y, const ExactRgb& sum, double unit, float* boxes) const {
  const auto box_x = static_cast<unsigned>(x) / kBoxSide, box_y = static_cast<unsigned>(y) / kBoxSide,
             across = static_cast<unsigned>(columns()) / kBoxSide;
  if (box_x < across && box_y < static_cast<unsigned>(rows()) / kBoxSide)
    add_sum(sum, unit, boxes + 3 * (size_t{box_y} * across + box_x));
}

void TrackedPixels::add_camera(const PixelRect& r, const ExactRgb* from, double unit, TrackedSums* to) const {
  const PixelRect& crop = grid_.crop;
  if (all()) {
    for (int y = r.y0; y < r.y1; ++y) {
      for (int x = r.x0; x < r.x1; ++x)
        add_sum(*from++, unit, &to->pixels[3 * index(interleave_.film_index(x, y))]);
    }
    return;
  }
  for (int y = r.y0; y < r.y1; ++y, from += r.width()) {
    for (int x = r.x0; x < r.x1; ++x) {
      const FilmPixel p = interleave_.to_film(x, y);
      add_to_box(p.x - crop.x0, p.y - crop.y0, from[x - r.x0], unit, to->boxes.data());
    }
    const int64_t begin = int64_t{y - crop.y0} * columns() + r.x0 - crop.x0, end = begin + r.width();
    auto place = std::lower_bound(in_packets_.begin(), in_packets_.end(), begin,
                                  [](const Place& p, int64_t at) { return int64_t{p.pixel} < at; });
    for (; place != in_packets_.end() && place->pixel < end; ++place)
      add_sum(from[place->pixel - begin], unit, &to->pixels[3 * size_t{place->at}]);
  }
}

void TrackedPixels::add_splat(int64_t pixel, const ExactRgb& sum, double unit, size_t* hint,
                              TrackedSums* to) const {
  if (all()) {
    add_sum(sum, unit, &to->pixels[3 * index(pixel)]);
    return;
  }
  add_to_box(static_cast<int>(pixel % columns()), static_cast<int>(pixel / columns()), sum, unit,
             to->boxes.data());
  while (*hint < in_film_.size() && in_film_[*hint].pixel < pixel) ++*hint;
  if (*hint < in_film_.size() && in_film_[*hint].pixel == pixel)
    add_sum(sum, unit, &to->pixels[3 * size_t{in_film_[*hint].at}]);
}

std::vector<float> TrackedPixels::box_sums(const TrackedSums& sums, int side) const {
  if (all()) return sums_of_squares(sums.pixels, index(columns()), index(side));
  // Of the tracked boxes each is a row.
  if (side == kSide) return sums_of_rows(sums.pixels, index(kBoxPixels));
  return sums_of_squares(sums.boxes, index(columns() / kBoxSide), index(side / kBoxSide));
}

PixelLayout TrackedPixels::box_layout(int side) const {
  if (!all() && side == kSide && !too_narrow()) return {1, chosen_.size(), {0, 0}, {0, 0}};
  return {index(columns() / side), index(rows() / side)};
}

}  // namespace lightmill
