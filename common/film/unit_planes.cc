#include "common/film/unit_planes.h"

#include <algorithm>
#include <cstdint>

namespace lightmill {

namespace {

// Strips stay in the L1 cache while every plane reads them.
constexpr size_t kStrip = PlaneStrips::kPixels;

const ExactRgb& sum_of(const ExactRgb& sum) { return sum; }
const ExactRgb& sum_of(const Partial::SplatSum& splat) { return splat.sum; }
ExactRgb& sum_of(ExactRgb& sum) { return sum; }
ExactRgb& sum_of(Partial::SplatSum& splat) { return splat.sum; }

template <typename T>
ByteRange used_bytes_of(std::span<const T> sums) {
  Units any = 0;
  for (const T& s : sums) any |= sum_of(s).c[0] | sum_of(s).c[1] | sum_of(s).c[2];
  return used_bytes(any);
}

/// Writes the planes of one channel to `base`, those of pixel i at `place(i)`, which grows with i.
template <typename T, typename Place>
void write_channel(std::span<const T> sums, int channel, ByteRange range, size_t pixels, Place place,
                   char* base) {
  for (size_t first = 0; first < sums.size(); first += kStrip) {
    const size_t count = std::min(sums.size() - first, kStrip);
    uint64_t low[kStrip], high[kStrip];  // halves of the sums side by side, as in read_strip
    for (size_t i = 0; i < count; ++i) {
      const Units units = sum_of(sums[first + i]).c[channel];
      low[i] = static_cast<uint64_t>(units);
      high[i] = static_cast<uint64_t>(units >> 64);
    }
    const size_t at = place(first);
    const bool side_by_side = place(first + count - 1) - at == count - 1;
    char* plane = base;
    for (unsigned b = range.low; b < range.high; ++b, plane += pixels) {
      const uint64_t* const half = b < 8 ? low : high;
      const unsigned shift = 8 * (b % 8);
      if (side_by_side) {
        for (size_t i = 0; i < count; ++i) plane[at + i] = static_cast<char>(half[i] >> shift);
      } else {
        for (size_t i = 0; i < count; ++i) plane[place(first + i)] = static_cast<char>(half[i] >> shift);
      }
    }
  }
}

constexpr auto kInOrder = [](size_t i) { return i; };

template <typename T>
void append_planes_of(std::span<const T> sums, ByteRange range, std::string* out) {
  const size_t n = sums.size(), start = out->size();
  out->resize(start + plane_bytes(n, range));
  for (int c = 0; c < 3; ++c) {
    char* base = out->data() + start + static_cast<size_t>(c) * n * range.count();
    write_channel(sums, c, range, n, kInOrder, base);
  }
}

template <typename T, typename Place>
void for_planes_of(std::span<const T> sums, ByteRange range, size_t pixels, Place place,
                   const TakeBytes& take) {
  std::string channel(pixels * range.count(), '\0');
  for (int c = 0; c < 3; ++c) {
    write_channel(sums, c, range, pixels, place, channel.data());
    take(channel);
  }
}

/// Reads `count` sums, at most kStrip, from pixel `first` of `pixels` on; `set(i, channel, units)` takes
/// them.
template <typename Set>
void read_strip(std::string_view planes, ByteRange range, size_t pixels, size_t first, size_t count,
                Set set) {
  const char* plane = planes.data() + first;
  for (int c = 0; c < 3; ++c) {
    // Halves of the sums side by side, where a plane is added eight bytes or more at a time.
    uint64_t low[kStrip] = {}, high[kStrip] = {};
    for (unsigned b = range.low; b < range.high; ++b, plane += pixels) {
      uint64_t* const half = b < 8 ? low : high;
      const unsigned shift = 8 * (b % 8);
      for (size_t i = 0; i < count; ++i) half[i] |= uint64_t{static_cast<unsigned char>(plane[i])} << shift;
    }
    for (size_t i = 0; i < count; ++i) set(i, c, static_cast<Units>(high[i]) << 64 | low[i]);
  }
}

template <typename T>
void read_planes_of(std::string_view planes, ByteRange range, std::span<T> sums) {
  for (size_t first = 0; first < sums.size(); first += kStrip) {
    const size_t count = std::min(sums.size() - first, kStrip);
    read_strip(planes, range, sums.size(), first, count,
               [&](size_t i, int c, Units units) { sum_of(sums[first + i]).c[c] = units; });
  }
}

}  // namespace

ByteRange used_bytes(Units any) {
  if (any == 0) return {};
  ByteRange range{0, sizeof(Units)};
  while (((any >> (8 * range.low)) & 0xff) == 0) ++range.low;
  while (((any >> (8 * (range.high - 1))) & 0xff) == 0) --range.high;
  return range;
}
ByteRange used_bytes(std::span<const ExactRgb> sums) { return used_bytes_of(sums); }
ByteRange used_bytes(std::span<const Partial::SplatSum> sums) { return used_bytes_of(sums); }

void append_planes(std::span<const ExactRgb> sums, ByteRange range, std::string* out) {
  append_planes_of(sums, range, out);
}
void append_planes(std::span<const Partial::SplatSum> sums, ByteRange range, std::string* out) {
  append_planes_of(sums, range, out);
}
void for_planes(std::span<const ExactRgb> sums, ByteRange range, const TakeBytes& take) {
  for_planes_of(sums, range, sums.size(), kInOrder, take);
}
void for_planes(std::span<const Partial::SplatSum> sums, ByteRange range, const TakeBytes& take) {
  for_planes_of(sums, range, sums.size(), kInOrder, take);
}
void for_planes(std::span<const Partial::SplatSum> sums, ByteRange range, size_t pixels,
                const std::function<size_t(const Partial::SplatSum&)>& place, const TakeBytes& take) {
  std::vector<uint32_t> places;
  places.reserve(sums.size());
  for (const Partial::SplatSum& splat : sums) places.push_back(static_cast<uint32_t>(place(splat)));
  for_planes_of(
      sums, range, pixels, [&](size_t i) { return size_t{places[i]}; }, take);
}
void read_planes(std::string_view planes, ByteRange range, std::span<ExactRgb> sums) {
  read_planes_of(planes, range, sums);
}
void read_planes(std::string_view planes, ByteRange range, std::span<Partial::SplatSum> sums) {
  read_planes_of(planes, range, sums);
}

std::span<const ExactRgb> PlaneStrips::next() {
  const size_t count = std::min(pixels_ - first_, kStrip);
  read_strip(planes_, range_, pixels_, first_, count,
             [&](size_t i, int c, Units units) { sums_[i].c[c] = units; });
  first_ += count;
  return std::span(sums_).first(count);
}

}  // namespace lightmill
