#pragma once
// Counter-based Owen-scrambled Sobol' points, padded: every dimension of a path draws from its own
// independently scrambled and shuffled copy of the first two Sobol' dimensions (a (0,2)-sequence), so there
// is no last dimension. A point is a pure function of (key, dimension, index).
//
// Sources: Kollig & Keller 2002 (padding); Burley, "Practical Hash-based Owen Scrambling", JCGT 2020; the
// hash after Laine & Karras 2011 with Vegdahl's constants (2021).
#include "worker/render/math/lanes.h"

namespace lightmill {

/// Integer hash with good avalanche (Wellons' lowbias32).
template <class U>
inline U hash32(U x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  x ^= x >> 16;
  return x;
}
template <class U>
inline U hash_combine(U key, uint32_t value) {
  return hash32(key ^ hash32(value + 0x9e3779b9u));
}

/// Key of a stream: (job seed, kind of path, position, batch of samples), mixed in 64 bits (splitmix64).
inline uint32_t stream_key(uint64_t seed, uint32_t stream, uint64_t position, uint64_t batch) {
  auto mix = [](uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
  };
  uint64_t h = mix(seed + 0x9e3779b97f4a7c15ull);
  h = mix(h ^ (position + 0x632be59bd9b4e019ull * (stream + 1)));
  h = mix(h ^ (batch + 0xd1342543de82ef95ull));
  return static_cast<uint32_t>(h >> 32);
}

inline uint32_t reverse_bits(uint32_t x) {
  x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  return __builtin_bswap32(x);
}
/// The same with two look-ups of half bytes, whose tables are in a register.
inline Uint8 reverse_bits(Uint8 x) {
  const __m256i bytes = _mm256_shuffle_epi8(
      reinterpret_cast<__m256i>(x), _mm256_setr_epi8(3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12, 3,
                                                     2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12));
  const __m256i high = _mm256_setr_epi8(
      0x00, -0x80, 0x40, -0x40, 0x20, -0x60, 0x60, -0x20, 0x10, -0x70, 0x50, -0x30, 0x30, -0x50, 0x70, -0x10,
      0x00, -0x80, 0x40, -0x40, 0x20, -0x60, 0x60, -0x20, 0x10, -0x70, 0x50, -0x30, 0x30, -0x50, 0x70, -0x10);
  const __m256i half = _mm256_set1_epi8(0x0f);
  const __m256i low = _mm256_and_si256(_mm256_srli_epi32(high, 4), half);
  const __m256i reversed =
      _mm256_or_si256(_mm256_shuffle_epi8(high, _mm256_and_si256(bytes, half)),
                      _mm256_shuffle_epi8(low, _mm256_and_si256(_mm256_srli_epi32(bytes, 4), half)));
  return reinterpret_cast<Uint8>(reversed);
}

/// Nested uniform (Owen) scramble of a bit-reversed value: each bit is flipped by a hash of lower bits only.
template <class U>
inline U owen_hash(U x, U seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

/// Sobol' dimension 2 before bit reversal: the Pascal matrix mod 2, i.e. the Taylor shift P(x) -> P(x + 1) of
/// the index as a polynomial over GF(2), in five steps since (1 + x)^(2^m) = 1 + x^(2^m).
template <class U>
inline U pascal_shift(U p) {
  p ^= (p >> 16) & 0x0000ffffu;
  p ^= (p >> 8) & 0x00ff00ffu;
  p ^= (p >> 4) & 0x0f0f0f0fu;
  p ^= (p >> 2) & 0x33333333u;
  p ^= (p >> 1) & 0x55555555u;
  return p;
}

/// 24-bit uniform in [0, 1).
template <class F>
inline F unit_float(UintOf<F> x) {
  return to_float(as_int(x >> 8)) * 0x1p-24f;
}

/// A path's sample stream: `key` from stream_key, `index` within its batch.
template <class F>
struct SampleStream {
  using U = UintOf<F>;
  U key, index;

  /// 2D point of dimension `dim`.
  void get_2d(uint32_t dim, F* u, F* v) const {
    const U k = hash_combine(key, dim);
    const U i = reverse_bits(owen_hash(reverse_bits(index), k));  // shuffle
    *u = unit_float<F>(reverse_bits(owen_hash(i, hash32(k ^ 0x68bc21ebu))));
    *v = unit_float<F>(reverse_bits(owen_hash(pascal_shift(i), hash32(k ^ 0x02e5be93u))));
  }
  /// 1D point of dimension `dim`.
  F get_1d(uint32_t dim) const {
    const U k = hash_combine(key, dim);
    const U i = reverse_bits(owen_hash(reverse_bits(index), k));
    return unit_float<F>(reverse_bits(owen_hash(i, hash32(k ^ 0x68bc21ebu))));
  }
  /// Independent uniform, for decisions that gain nothing from stratification.
  F get_random(uint32_t dim) const { return unit_float<F>(get_seed(dim)); }
  /// A seed of more independent numbers.
  U get_seed(uint32_t dim) const { return hash32(hash_combine(key, dim) ^ hash32(index)); }
};

}  // namespace lightmill
