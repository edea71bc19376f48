#pragma once
// Functions of texture graphs: of any argument, finite, with fixed bits on every machine and every lane
// width.
#include "worker/render/math/angle.h"
#include "worker/render/math/exp.h"

namespace lightmill::graph {

template <class F>
inline F truncate(F x) {
  return copysign(floor(abs(x)), x);
}
/// What is no number, or too large to have a place on a lattice, is 0.
template <class F>
inline F usable(F x) {
  return select(MaskOf<F>(abs(x) < 1e9f), x, F{});
}
/// 0 where b is 0.
template <class F>
inline F quotient(F a, F b) {
  const MaskOf<F> zero = MaskOf<F>(b == 0.0f);
  return select(zero, F{}, a / select(zero, splat<F>(1.0f), b));
}
template <class F>
inline F blend(F a, F b, F t) {
  return a + (b - a) * t;
}

/// Relative error below 3e-7; at most 2.2e38. As exp_negative.
template <class F>
inline F exponential(F x) {
  const F c = clamp(x, -87.0f, 88.3f);
  const F n = floor(c * 1.44269504f + 0.5f);
  F r = c - n * 0.693359375f;
  r = r - n * -2.12194440e-4f;
  F p = splat<F>(1.0f / 5040);
  p = p * r + 1.0f / 720;
  p = p * r + 1.0f / 120;
  p = p * r + 1.0f / 24;
  p = p * r + 1.0f / 6;
  p = p * r + 0.5f;
  p = p * r + 1.0f;
  p = p * r + 1.0f;
  return select(MaskOf<F>(x < -87.0f), F{}, p * bits_float(as_uint((to_int(n) + 127) << 23)));
}

/// 0 where there is none.
template <class F>
inline F logarithm(F x) {
  const MaskOf<F> ok = MaskOf<F>(x >= 1.2e-38f);
  return select(ok, log_positive(min(select(ok, x, splat<F>(1.0f)), splat<F>(1.7e38f))), F{});
}

/// 0 where there is none.
template <class F>
inline F power(F a, F b) {
  const F whole = floor(b), half = floor(b * 0.5f) * 2.0f;
  const MaskOf<F> negative = MaskOf<F>(a < 0.0f), none = mask_and(negative, MaskOf<F>(b != whole));
  const F m = exponential(b * logarithm(abs(a)));
  const F x = select(mask_and(negative, MaskOf<F>(whole != half)), -m, m);
  const F y = select(mask_or(none, MaskOf<F>(a == 0.0f)), F{}, x);
  return select(MaskOf<F>(b == 0.0f), splat<F>(1.0f), y);
}

/// Arguments beyond a million, where float has no digits left for an angle, count as 0.
template <class F>
inline void sine_cosine(F x, F* sine, F* cosine) {
  x = select(MaskOf<F>(abs(x) < 1e6f), x, F{});
  const F k = floor(x * (2.0f * kInvPi) + 0.5f);
  F r = x - k * 1.5703125f;  // pi / 2 in three parts
  r = r - k * 4.837512969970703125e-4f;
  r = r - k * 7.54978995489188216e-8f;
  F s, c;
  sincos_quarter(r, &s, &c);
  const IntOf<F> quadrant = to_int(k) & 3;
  const MaskOf<F> swap = (quadrant & 1) != 0;
  const F a = select(swap, c, s), b = select(swap, s, c);
  *sine = select(MaskOf<F>(quadrant >= 2), -a, a);
  *cosine = select(mask_or(MaskOf<F>(quadrant == 1), MaskOf<F>(quadrant == 2)), -b, b);
}

/// In [-pi, pi]; 0 at the origin.
template <class F>
inline F arctangent2(F y, F x) {
  const F ax = abs(x), ay = abs(y), a = max(ax, ay), b = min(ax, ay);
  F t = atan_unit<F>(quotient(b, a));
  t = select(MaskOf<F>(ay > ax), 0.5f * kPi - t, t);
  t = select(MaskOf<F>(x < 0.0f), kPi - t, t);
  return copysign(t, y);
}
template <class F>
inline F arcsine(F x) {
  x = clamp(x, -1.0f, 1.0f);
  return arctangent2(x, sqrt((1.0f - x) * (1.0f + x)));
}
template <class F>
inline F arccosine(F x) {
  x = clamp(x, -1.0f, 1.0f);
  return arctangent2(sqrt((1.0f - x) * (1.0f + x)), x);
}
/// By its series where the difference of exponentials would have few digits.
template <class F>
inline F hyperbolic_sine(F x) {
  const F up = exponential(abs(x)), x2 = x * x;
  const F small = x * (1.0f + x2 * (1.0f / 6 + x2 * (1.0f / 120 + x2 * (1.0f / 5040))));
  return select(MaskOf<F>(abs(x) < 0.5f), small, copysign((up - 1.0f / up) * 0.5f, x));
}
template <class F>
inline F hyperbolic_cosine(F x) {
  const F up = exponential(abs(x));
  return (up + 1.0f / up) * 0.5f;
}
template <class F>
inline F hyperbolic_tangent(F x) {
  const F up = exponential(min(abs(x), splat<F>(20.0f)) * 2.0f), x2 = x * x;
  const F small =
      x * (1.0f + x2 * (-1.0f / 3 + x2 * (2.0f / 15 + x2 * (-17.0f / 315 + x2 * (62.0f / 2835)))));
  return select(MaskOf<F>(abs(x) < 0.25f), small, copysign((up - 1.0f) / (up + 1.0f), x));
}

/// Of the sign of a; 0 where b is 0.
template <class F>
inline F remainder(F a, F b) {
  return a - b * truncate(quotient(a, b)) - select(MaskOf<F>(b == 0.0f), a, F{});
}
/// Into the range from b to c.
template <class F>
inline F wrapped(F a, F high, F low) {
  const F range = high - low;
  const F x = a - range * floor(quotient(a - low, range));
  return select(MaskOf<F>(range == 0.0f), low, x);
}
template <class F>
inline F ping_pong(F a, F b) {
  const F t = quotient(a - b, b * 2.0f);
  return select(MaskOf<F>(b == 0.0f), F{}, abs((t - floor(t)) * b * 2.0f - b));
}
/// Polynomial smooth minimum of width k.
template <class F>
inline F smooth_minimum(F a, F b, F k) {
  const F h = quotient(max(k - abs(a - b), F{}), k);
  return min(a, b) - h * h * h * k * (1.0f / 6.0f);
}

}  // namespace lightmill::graph
