#pragma once
// Exponential with fixed bits on every machine and every lane width.
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

}  // namespace lightmill
