#pragma once
// Exponential and logarithm with fixed bits on every machine and every lane width.
#include "worker/render/math/lanes.h"

namespace lightmill {

/// e^x for x <= 0 (clamped to [-80, 0]); relative error below 3e-7. Cody-Waite reduction x = n ln2 + r, then
/// the Taylor polynomial of e^r on |r| <= ln2 / 2 in Horner form.
template <class F>
inline F exp_negative(F x) {
  x = clamp(x, -80.0f, 0.0f);
  const F n = floor(x * 1.44269504f + 0.5f);
  F r = x - n * 0.693359375f;
  r = r - n * -2.12194440e-4f;
  F p = splat<F>(1.0f / 720);
  p = p * r + 1.0f / 120;
  p = p * r + 1.0f / 24;
  p = p * r + 1.0f / 6;
  p = p * r + 0.5f;
  p = p * r + 1.0f;
  p = p * r + 1.0f;
  return p * bits_float(as_uint((to_int(n) + 127) << 23));
}

/// ln x for x in [2^-126, 2^127]; error below 3e-7 of max(1, |ln x|). x = 2^n m with m in [sqrt(1/2),
/// sqrt(2)), and ln m = 2 artanh((m - 1) / (m + 1)) by its series.
template <class F>
inline F log_positive(F x) {
  const IntOf<F> bits = as_int(float_bits(x));
  // Bits of sqrt(1/2), from which m is counted.
  const IntOf<F> n = (bits - 0x3f3504f3) >> 23;
  const F m = bits_float(as_uint(bits - (n << 23)));
  const F s = (m - 1.0f) / (m + 1.0f), s2 = s * s;
  F p = splat<F>(2.0f / 9);
  p = p * s2 + 2.0f / 7;
  p = p * s2 + 2.0f / 5;
  p = p * s2 + 2.0f / 3;
  p = p * s2 + 2.0f;
  const F k = to_float(n);
  return k * 0.693359375f + (p * s + k * -2.12194440e-4f);
}

/// -ln(1 - x) for x in [0, 1), of which `rest` = 1 - x, where that is known better; relative error below
/// 4e-7.
template <class F>
inline F minus_log_one_minus(F x, F rest) {
  // For small x the series of log_positive, whose argument (m - 1) / (m + 1) is then -x / (2 - x).
  const MaskOf<F> small = MaskOf<F>(x < 0.29f);
  const F y = select(small, x, F{});
  const F s = y / (2.0f - y), s2 = s * s;
  F p = splat<F>(2.0f / 9);
  p = p * s2 + 2.0f / 7;
  p = p * s2 + 2.0f / 5;
  p = p * s2 + 2.0f / 3;
  p = p * s2 + 2.0f;
  return select(small, p * s, -log_positive(select(small, splat<F>(0.5f), rest)));
}

}  // namespace lightmill
