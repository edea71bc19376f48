#pragma once
// Byte planes of exact sums: the layout of layers before compression.
//
// A sum has 16 bytes, of which the upper and lower ones are zero throughout a layer: only the range that is
// used is stored. Each channel and byte has a plane with that byte of every pixel, so that like bytes lie
// together.
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/film/exact_sum.h"
#include "common/film/partial.h"

namespace lightmill {

/// Bytes [low, high) of a sum, 0 = least significant. Empty (0, 0) for a layer of zeros.
struct ByteRange {
  uint8_t low = 0, high = 0;
  size_t count() const { return static_cast<size_t>(high - low); }
  bool valid() const { return high <= sizeof(Units) && (low < high || (low == 0 && high == 0)); }
  bool operator==(const ByteRange&) const = default;
};

/// Bytes that the planes of `pixels` sums take.
inline size_t plane_bytes(size_t pixels, ByteRange range) { return pixels * 3 * range.count(); }

/// Smallest range that holds every sum; of sums whose units or'd together are `any`.
ByteRange used_bytes(Units any);
ByteRange used_bytes(std::span<const ExactRgb> sums);
ByteRange used_bytes(std::span<const Partial::SplatSum> sums);

/// Appends the planes.
void append_planes(std::span<const ExactRgb> sums, ByteRange range, std::string* out);
void append_planes(std::span<const Partial::SplatSum> sums, ByteRange range, std::string* out);

/// Hands the same bytes to `take`, one channel after the other, so that no more than a third of them is in
/// memory.
using TakeBytes = std::function<void(std::string_view)>;
void for_planes(std::span<const ExactRgb> sums, ByteRange range, const TakeBytes& take);
void for_planes(std::span<const Partial::SplatSum> sums, ByteRange range, const TakeBytes& take);
/// Planes of `pixels` sums: sum i lies at place(i), and the other places are zero.
void for_planes(std::span<const Partial::SplatSum> sums, ByteRange range, size_t pixels,
                const std::function<size_t(const Partial::SplatSum&)>& place, const TakeBytes& take);

/// Inverse. `planes` has plane_bytes(sums.size(), range) bytes.
void read_planes(std::string_view planes, ByteRange range, std::span<ExactRgb> sums);
void read_planes(std::string_view planes, ByteRange range, std::span<Partial::SplatSum> sums);

/// The same sums, a strip of pixels at a time, so that those that are not kept need no memory.
class PlaneStrips {
 public:
  static constexpr size_t kPixels = 256;  // of a strip
  /// `planes` has plane_bytes(pixels, range) bytes, and must outlive the strips.
  PlaneStrips(std::string_view planes, ByteRange range, size_t pixels)
      : planes_(planes), range_(range), pixels_(pixels) {}
  /// The next sums; none after the last. They are valid until the next call.
  std::span<const ExactRgb> next();

 private:
  const std::string_view planes_;
  const ByteRange range_;
  const size_t pixels_;
  size_t first_ = 0;
  std::array<ExactRgb, kPixels> sums_;
};

}  // namespace lightmill
