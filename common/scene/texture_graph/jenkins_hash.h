#pragma once
// Bob Jenkins' hash of a few words (lookup3, 2006, public domain), which the noises of Cycles are made of.
#include <cstdint>

namespace lightmill {

template <class U>
inline U rotated(U x, int k) {
  return (x << k) | (x >> (32 - k));
}

/// Of one to four words; U is uint32_t or lanes of it.
template <class U>
inline U jenkins_hash_words(int count, const U& x, const U& y, const U& z, const U& w) {
  U a = U{} + (0xdeadbeefu + (static_cast<uint32_t>(count) << 2) + 13u), b = a, c = a;
  a += x;
  if (count > 1) b += y;
  if (count > 2) c += z;
  if (count > 3) {
    a -= c, a ^= rotated(c, 4), c += b;
    b -= a, b ^= rotated(a, 6), a += c;
    c -= b, c ^= rotated(b, 8), b += a;
    a -= c, a ^= rotated(c, 16), c += b;
    b -= a, b ^= rotated(a, 19), a += c;
    c -= b, c ^= rotated(b, 4), b += a;
    a += w;
  }
  c ^= b, c -= rotated(b, 14);
  a ^= c, a -= rotated(c, 11);
  b ^= a, b -= rotated(a, 25);
  c ^= b, c -= rotated(b, 16);
  a ^= c, a -= rotated(c, 4);
  b ^= a, b -= rotated(a, 14);
  c ^= b, c -= rotated(b, 24);
  return c;
}
template <class U>
inline U jenkins_hash(const U& x) {
  return jenkins_hash_words(1, x, x, x, x);
}
template <class U>
inline U jenkins_hash(const U& x, const U& y) {
  return jenkins_hash_words(2, x, y, y, y);
}
template <class U>
inline U jenkins_hash(const U& x, const U& y, const U& z) {
  return jenkins_hash_words(3, x, y, z, z);
}
template <class U>
inline U jenkins_hash(const U& x, const U& y, const U& z, const U& w) {
  return jenkins_hash_words(4, x, y, z, w);
}

/// In [0, 1].
inline float unit_float(uint32_t h) { return static_cast<float>(h) * 0x1p-32f; }

}  // namespace lightmill
