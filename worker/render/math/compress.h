#pragma once
// Lanes of a mask side by side, in their order.
#include <array>

#include "worker/render/math/lanes.h"

namespace lightmill {

namespace compress_detail {

/// For each mask of eight bits the numbers of its bits, padded with 0.
inline constexpr auto kLanesOf = [] {
  std::array<std::array<uint8_t, 8>, 256> table{};
  for (size_t mask = 0; mask < 256; ++mask) {
    size_t n = 0;
    for (size_t l = 0; l < 8; ++l) {
      if (mask >> l & 1) table[mask][n++] = static_cast<uint8_t>(l);
    }
  }
  return table;
}();

inline __m256i order_of(unsigned mask) {
  return _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(kLanesOf[mask].data())));
}

}  // namespace compress_detail

/// Stores the lanes of x in `mask` at p, p + 1 ...; up to p + 7 is overwritten with anything.
inline void store_compressed(float* p, Float8 x, unsigned mask) {
  _mm256_storeu_ps(p, _mm256_permutevar8x32_ps(reinterpret_cast<__m256>(x), compress_detail::order_of(mask)));
}
inline void store_compressed(int32_t* p, Int8 x, unsigned mask) {
  _mm256_storeu_si256(
      reinterpret_cast<__m256i*>(p),
      _mm256_permutevar8x32_epi32(reinterpret_cast<__m256i>(x), compress_detail::order_of(mask)));
}
inline void store_compressed(float* p, float x, unsigned mask) {
  if (mask & 1) *p = x;
}
inline void store_compressed(int32_t* p, int32_t x, unsigned mask) {
  if (mask & 1) *p = x;
}

}  // namespace lightmill
