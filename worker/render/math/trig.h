#pragma once
// Sine and cosine with fixed bits on every machine and every lane width.
#include "worker/render/math/lanes.h"

namespace lightmill {

inline constexpr float kPi = 3.14159265358979323846f;
inline constexpr float kInvPi = 0.31830988618379067154f;

/// sin and cos of x in [-pi/4, pi/4] by Taylor polynomials in Horner form; absolute error below 1e-7.
template <class F>
inline void sincos_quarter(F x, F* sine, F* cosine) {
  const F x2 = x * x;
  *sine = x * (1.0f + x2 * (-1.0f / 6 + x2 * (1.0f / 120 + x2 * (-1.0f / 5040 + x2 * (1.0f / 362880)))));
  *cosine = 1.0f + x2 * (-0.5f + x2 * (1.0f / 24 + x2 * (-1.0f / 720 + x2 * (1.0f / 40320))));
}

/// sin and cos of 2 pi u for u in [0, 1].
template <class F>
inline void sincos_2pi(F u, F* sine, F* cosine) {
  // Nearest multiple of a quarter turn q in 0..4, remainder in [-1/8, 1/8] turns: exact in float.
  const IntOf<F> q = to_int(u * 4.0f + 0.5f);
  const F r = u - to_float(q) * 0.25f;
  F s, c;
  sincos_quarter(r * (2.0f * kPi), &s, &c);
  const IntOf<F> quadrant = q & 3;
  const MaskOf<F> swap = (quadrant & 1) != 0;
  const F a = select(swap, c, s), b = select(swap, s, c);
  *sine = select(MaskOf<F>(quadrant >= 2), -a, a);
  *cosine = select(mask_or(MaskOf<F>(quadrant == 1), MaskOf<F>(quadrant == 2)), -b, b);
}

}  // namespace lightmill
