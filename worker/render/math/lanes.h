#pragma once
// Lanes: one source for scalar and vector kernels.
//
// Kernels are templates over a lane type F: `float` (width 1) or `Float8` (AVX2, width 8). Arithmetic
// operators work on both; what differs goes through the functions below. Lane i of a Float8 kernel has the
// same bits as the float kernel on lane i's inputs: every operation here is IEEE-exact or a fixed sequence
// of such operations (no reciprocal estimates, no contraction).
//
//   template <class F> F safe_sqrt(F x) { return sqrt(max(x, F{})); }
#include <immintrin.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace lightmill {

using Float8 = float __attribute__((vector_size(32)));
using Int8 = int32_t __attribute__((vector_size(32)));
using Uint8 = uint32_t __attribute__((vector_size(32)));
using Double4 = double __attribute__((vector_size(32)));
using Long4 = int64_t __attribute__((vector_size(32)));

template <class F>
struct LaneTraits;
template <>
struct LaneTraits<float> {
  static constexpr int kWidth = 1;
  using Int = int32_t;
  using Uint = uint32_t;
  using Mask = bool;
  using Double = double;
};
template <>
struct LaneTraits<Float8> {
  static constexpr int kWidth = 8;
  using Int = Int8;
  using Uint = Uint8;
  using Mask = Int8;  // 0 or -1 per lane
  using Double = Double4;
};
template <>
struct LaneTraits<double> {
  using Mask = bool;
};
template <>
struct LaneTraits<Double4> {
  using Mask = Long4;
};
template <class F>
inline constexpr int kWidth = LaneTraits<F>::kWidth;
template <class F>
using IntOf = typename LaneTraits<F>::Int;
template <class F>
using UintOf = typename LaneTraits<F>::Uint;
template <class F>
using MaskOf = typename LaneTraits<F>::Mask;
/// What float has too few bits for is worked out in kDoubleParts values of this type, one after the other.
template <class F>
using DoubleOf = typename LaneTraits<F>::Double;
template <class F>
inline constexpr int kDoubleParts = static_cast<int>(sizeof(F) * 2 / sizeof(DoubleOf<F>));

// --- broadcast -------------------------------------------------------------------------------------
template <class F>
inline F splat(float x);
template <>
inline float splat<float>(float x) {
  return x;
}
template <>
inline Float8 splat<Float8>(float x) {
  return reinterpret_cast<Float8>(_mm256_set1_ps(x));
}
template <class F>
inline IntOf<F> splat_int(int32_t x) {
  return IntOf<F>{} + x;
}
template <class F>
inline UintOf<F> splat_uint(uint32_t x) {
  return UintOf<F>{} + x;
}
template <class F>
inline MaskOf<F> splat_mask(bool x);
template <>
inline bool splat_mask<float>(bool x) {
  return x;
}
template <>
inline Int8 splat_mask<Float8>(bool x) {
  return Int8{} - static_cast<int32_t>(x);
}

// --- select and masks ------------------------------------------------------------------------------
inline float select(bool m, float a, float b) { return m ? a : b; }
inline int32_t select(bool m, int32_t a, int32_t b) { return m ? a : b; }
inline uint32_t select(bool m, uint32_t a, uint32_t b) { return m ? a : b; }
inline Float8 select(Int8 m, Float8 a, Float8 b) {
  return reinterpret_cast<Float8>(_mm256_blendv_ps(reinterpret_cast<__m256>(b), reinterpret_cast<__m256>(a),
                                                   reinterpret_cast<__m256>(m)));
}
inline Float8 select(Int8 m, Float8 a, float b) { return select(m, a, splat<Float8>(b)); }
inline Float8 select(Int8 m, float a, Float8 b) { return select(m, splat<Float8>(a), b); }
inline Int8 select(Int8 m, Int8 a, Int8 b) { return m ? a : b; }
inline Uint8 select(Int8 m, Uint8 a, Uint8 b) { return m ? a : b; }

inline bool mask_not(bool m) { return !m; }
inline Int8 mask_not(Int8 m) { return ~m; }
inline bool mask_and(bool a, bool b) { return a && b; }
inline Int8 mask_and(Int8 a, Int8 b) { return a & b; }
inline bool mask_or(bool a, bool b) { return a || b; }
inline Int8 mask_or(Int8 a, Int8 b) { return a | b; }
inline bool any(bool m) { return m; }
inline bool any(Int8 m) {
  return !_mm256_testz_si256(reinterpret_cast<__m256i>(m), reinterpret_cast<__m256i>(m));
}
/// One bit per lane, lane 0 lowest.
inline unsigned mask_bits(bool m) { return m; }
inline unsigned mask_bits(Int8 m) {
  return static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<__m256>(m)));
}

// --- functions -------------------------------------------------------------------------------------
inline float sqrt(float x) { return std::sqrt(x); }
inline Float8 sqrt(Float8 x) { return reinterpret_cast<Float8>(_mm256_sqrt_ps(reinterpret_cast<__m256>(x))); }
/// min/max return the second argument if either is NaN (the x86 rule, kept in the scalar form).
inline float min(float a, float b) { return a < b ? a : b; }
inline float max(float a, float b) { return a > b ? a : b; }
inline Float8 min(Float8 a, Float8 b) {
  return reinterpret_cast<Float8>(_mm256_min_ps(reinterpret_cast<__m256>(a), reinterpret_cast<__m256>(b)));
}
inline Float8 max(Float8 a, Float8 b) {
  return reinterpret_cast<Float8>(_mm256_max_ps(reinterpret_cast<__m256>(a), reinterpret_cast<__m256>(b)));
}
inline Float8 min(Float8 a, float b) { return min(a, splat<Float8>(b)); }
inline Float8 max(Float8 a, float b) { return max(a, splat<Float8>(b)); }
inline float abs(float x) { return std::fabs(x); }
inline Float8 abs(Float8 x) {
  return reinterpret_cast<Float8>(reinterpret_cast<Uint8>(x) & (Uint8{} + 0x7fffffffu));
}
/// |x| with the sign bit of s.
inline float copysign(float x, float s) { return std::copysign(x, s); }
inline Float8 copysign(Float8 x, Float8 s) {
  const Uint8 sign = Uint8{} + 0x80000000u;
  return reinterpret_cast<Float8>((reinterpret_cast<Uint8>(x) & ~sign) | (reinterpret_cast<Uint8>(s) & sign));
}
inline uint32_t float_bits(float x) { return std::bit_cast<uint32_t>(x); }
inline Uint8 float_bits(Float8 x) { return reinterpret_cast<Uint8>(x); }
inline float bits_float(uint32_t x) { return std::bit_cast<float>(x); }
inline Float8 bits_float(Uint8 x) { return reinterpret_cast<Float8>(x); }
inline float to_float(int32_t x) { return static_cast<float>(x); }
inline Float8 to_float(Int8 x) { return __builtin_convertvector(x, Float8); }
/// Truncation towards zero; the value must fit.
inline int32_t to_int(float x) { return static_cast<int32_t>(x); }
inline Int8 to_int(Float8 x) { return __builtin_convertvector(x, Int8); }
inline uint32_t as_uint(int32_t x) { return static_cast<uint32_t>(x); }
inline Uint8 as_uint(Int8 x) { return reinterpret_cast<Uint8>(x); }
inline int32_t as_int(uint32_t x) { return static_cast<int32_t>(x); }
inline Int8 as_int(Uint8 x) { return reinterpret_cast<Int8>(x); }
inline float floor(float x) { return std::floor(x); }
inline Float8 floor(Float8 x) {
  return reinterpret_cast<Float8>(_mm256_floor_ps(reinterpret_cast<__m256>(x)));
}

template <class F>
inline F safe_sqrt(F x) {
  return sqrt(max(x, F{}));
}
template <class F>
inline F sqr(F x) {
  return x * x;
}
template <class F>
inline F clamp(F x, float lo, float hi) {
  return min(max(x, splat<F>(lo)), splat<F>(hi));
}

// --- memory ----------------------------------------------------------------------------------------
template <class F>
inline F load(const float* p);
template <>
inline float load<float>(const float* p) {
  return *p;
}
template <>
inline Float8 load<Float8>(const float* p) {
  return reinterpret_cast<Float8>(_mm256_loadu_ps(p));
}
template <class F>
inline IntOf<F> load_int(const int32_t* p);
template <>
inline int32_t load_int<float>(const int32_t* p) {
  return *p;
}
template <>
inline Int8 load_int<Float8>(const int32_t* p) {
  return reinterpret_cast<Int8>(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)));
}
inline void store(float* p, float x) { *p = x; }
inline void store(float* p, Float8 x) { _mm256_storeu_ps(p, reinterpret_cast<__m256>(x)); }
inline void store(int32_t* p, int32_t x) { *p = x; }
inline void store(int32_t* p, Int8 x) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(p), reinterpret_cast<__m256i>(x));
}
/// base[i] per lane; every index must be valid (masked-off lanes too).
inline float gather(const float* base, int32_t i) { return base[i]; }
inline Float8 gather(const float* base, Int8 i) {
  return reinterpret_cast<Float8>(_mm256_i32gather_ps(base, reinterpret_cast<__m256i>(i), 4));
}
inline int32_t gather(const int32_t* base, int32_t i) { return base[i]; }
inline Int8 gather(const int32_t* base, Int8 i) {
  return reinterpret_cast<Int8>(_mm256_i32gather_epi32(base, reinterpret_cast<__m256i>(i), 4));
}
/// base[i] = x for lanes in mask; lanes must not collide.
inline void scatter(float* base, int32_t i, float x, bool m) {
  if (m) base[i] = x;
}
inline void scatter(float* base, Int8 i, Float8 x, Int8 m) {
  for (int l = 0; l < 8; ++l) {
    if (m[l]) base[i[l]] = x[l];
  }
}
inline void scatter(int32_t* base, int32_t i, int32_t x, bool m) {
  if (m) base[i] = x;
}
inline void scatter(int32_t* base, Int8 i, Int8 x, Int8 m) {
  for (int l = 0; l < 8; ++l) {
    if (m[l]) base[i[l]] = x[l];
  }
}
/// Transposes an 8x8 block held in rows.
inline void transpose8(Float8 r[8]) {
  __m256 t[8], u[8];
  for (int i = 0; i < 4; ++i) {
    const auto a = reinterpret_cast<__m256>(r[2 * i]), b = reinterpret_cast<__m256>(r[2 * i + 1]);
    t[2 * i] = _mm256_unpacklo_ps(a, b);
    t[2 * i + 1] = _mm256_unpackhi_ps(a, b);
  }
  for (int h = 0; h < 2; ++h) {
    const int k = 4 * h;
    u[k] = _mm256_shuffle_ps(t[k], t[k + 2], 0x44);
    u[k + 1] = _mm256_shuffle_ps(t[k], t[k + 2], 0xee);
    u[k + 2] = _mm256_shuffle_ps(t[k + 1], t[k + 3], 0x44);
    u[k + 3] = _mm256_shuffle_ps(t[k + 1], t[k + 3], 0xee);
  }
  for (int i = 0; i < 4; ++i) {
    r[i] = reinterpret_cast<Float8>(_mm256_permute2f128_ps(u[i], u[i + 4], 0x20));
    r[i + 4] = reinterpret_cast<Float8>(_mm256_permute2f128_ps(u[i], u[i + 4], 0x31));
  }
}

/// base[i], base[i + 1] and base[i + 2] per lane; no other memory is touched. A load per lane takes less time
/// than three gathers.
inline void load_triples(const float* base, int32_t i, float r[3]) { std::copy_n(base + i, 3, r); }
[[gnu::always_inline]] inline void load_triples(const float* base, Int8 i, Float8 r[3]) {
  const __m128i three = _mm_setr_epi32(-1, -1, -1, 0);
  alignas(32) int32_t at[8];
  store(at, i);
  __m256 row[4];
  for (int l = 0; l < 4; ++l)
    row[l] = _mm256_set_m128(_mm_maskload_ps(base + at[l + 4], three), _mm_maskload_ps(base + at[l], three));
  const __m256 low01 = _mm256_unpacklo_ps(row[0], row[1]), low23 = _mm256_unpacklo_ps(row[2], row[3]);
  const __m256 high01 = _mm256_unpackhi_ps(row[0], row[1]), high23 = _mm256_unpackhi_ps(row[2], row[3]);
  r[0] = reinterpret_cast<Float8>(_mm256_shuffle_ps(low01, low23, 0x44));
  r[1] = reinterpret_cast<Float8>(_mm256_shuffle_ps(low01, low23, 0xee));
  r[2] = reinterpret_cast<Float8>(_mm256_shuffle_ps(high01, high23, 0x44));
}
/// The same of eight floats.
inline void load_octets(const float* base, int32_t i, float r[8]) { std::copy_n(base + i, 8, r); }
inline void load_octets(const float* base, Int8 i, Float8 r[8]) {
  alignas(32) int32_t at[8];
  store(at, i);
  for (int l = 0; l < 8; ++l) r[l] = load<Float8>(base + at[l]);
  transpose8(r);
}

/// Records of eight floats: r[k] is float k of record `index` per lane; every index must be valid.
template <class F>
inline void load_records(const float (*base)[8], IntOf<F> index, F r[8]) {
  load_octets(*base, index * 8, r);
}
/// Inverse, for lanes in the bits of `mask`, which must not collide.
inline void store_records(float (*base)[8], int32_t index, unsigned mask, const float r[8]) {
  if (mask & 1) std::copy_n(r, 8, base[index]);
}
inline void store_records(float (*base)[8], Int8 index, unsigned mask, const Float8 r[8]) {
  Float8 rows[8];
  std::copy_n(r, 8, rows);
  transpose8(rows);
  for (int l = 0; l < 8; ++l) {
    if (mask >> l & 1) store(base[index[l]], rows[l]);
  }
}

/// 0, 1, 2 ... per lane.
template <class F>
inline IntOf<F> lane_index();
template <>
inline int32_t lane_index<float>() {
  return 0;
}
template <>
inline Int8 lane_index<Float8>() {
  return Int8{0, 1, 2, 3, 4, 5, 6, 7};
}
// --- double ----------------------------------------------------------------------------------------
inline double select(bool m, double a, double b) { return m ? a : b; }
inline Double4 select(Long4 m, Double4 a, Double4 b) { return m ? a : b; }
inline Long4 mask_and(Long4 a, Long4 b) { return a & b; }
inline double sqrt(double x) { return std::sqrt(x); }
inline Double4 sqrt(Double4 x) { return _mm256_sqrt_pd(x); }
inline double copysign(double x, double s) { return std::copysign(x, s); }
inline Double4 copysign(Double4 x, Double4 s) {
  const Double4 sign = _mm256_set1_pd(-0.0);
  return _mm256_or_pd(_mm256_andnot_pd(sign, x), _mm256_and_pd(sign, s));
}
/// Part `part` of the lanes of x.
inline double to_double(float x, int) { return x; }
inline Double4 to_double(Float8 x, int part) {
  const auto v = reinterpret_cast<__m256>(x);
  return _mm256_cvtps_pd(part == 0 ? _mm256_castps256_ps128(v) : _mm256_extractf128_ps(v, 1));
}
/// Every lane, from its parts; rounded.
inline float from_double(const double* parts) { return static_cast<float>(*parts); }
inline Float8 from_double(const Double4* parts) {
  return reinterpret_cast<Float8>(_mm256_set_m128(_mm256_cvtpd_ps(parts[1]), _mm256_cvtpd_ps(parts[0])));
}

/// Lane `l` of a value.
inline float lane(float x, int) { return x; }
inline float lane(Float8 x, int l) { return x[l]; }
inline int32_t lane(int32_t x, int) { return x; }
inline int32_t lane(Int8 x, int l) { return x[l]; }
inline void set_lane(float* x, int, float value) { *x = value; }
inline void set_lane(Float8* x, int l, float value) { (*x)[l] = value; }
inline void set_lane(int32_t* x, int, int32_t value) { *x = value; }
inline void set_lane(Int8* x, int l, int32_t value) { (*x)[l] = value; }

}  // namespace lightmill
