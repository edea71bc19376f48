#pragma once
// Angles of points with fixed bits on every machine and every lane width.
#include "worker/render/math/trig.h"

namespace lightmill {

/// atan on [0, 1] with fixed bits; absolute error below 2e-7 (reduction at tan(pi/8), odd
/// minimax polynomial).
template <class F>
inline F atan_unit(F x) {
  const MaskOf<F> high = MaskOf<F>(x > 0.41421356f);
  const F r = select(high, (x - 1.0f) / (x + 1.0f), x);
  const F z = r * r;
  const F p =
      (((8.05374449538e-2f * z - 1.38776856032e-1f) * z + 1.99777106478e-1f) * z - 3.33329491539e-1f) * z *
          r +
      r;
  return select(high, p + kPi / 4, p);
}

/// Angle of (x, y) in turns, in [0, 1); 0 at the origin.
template <class F>
inline F turns(F y, F x) {
  const F ax = abs(x), ay = abs(y), a = max(ax, ay), b = min(ax, ay);
  const MaskOf<F> zero = MaskOf<F>(a == 0.0f);
  F t = atan_unit<F>(select(zero, F{}, b / select(zero, splat<F>(1.0f), a))) * (0.5f * kInvPi);
  t = select(MaskOf<F>(ay > ax), 0.25f - t, t);
  t = select(MaskOf<F>(x < 0.0f), 0.5f - t, t);
  return select(MaskOf<F>(y < 0.0f), 1.0f - t, t);
}

}  // namespace lightmill
