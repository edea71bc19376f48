#pragma once
// Blends of two filters, by how well each predicts the half that it has not seen.
//
// Let F and G be two estimates that were made of half A alone. As B's error is independent of A's,
//
//   E |F + t (G - F) - B|^2 = |error of the blend|^2 + Var(B)
//
// so the t that makes the left side least makes the blend's error least, bias included, whatever correlation
// errors of pixels have beside each other: t = <B - F, G - F> / <G - F, G - F>, clipped to [0, 1]. Sums are
// over the pixels around, both ways (A predicts B, B predicts A). It is Stein's shrinkage towards F, with an
// unbiased estimate of the risk from halves in place of known variances (Rousselle et al., "Adaptive Sampling
// and Reconstruction using Greedy Error Minimization", 2011, choose among filters per pixel in a like way).
#include "common/image/denoise/planes.h"

namespace lightmill::denoise {

/// Of the denominators of relMSE.
inline constexpr float kRelativeFloor = 1e-2f;

/// Which pixels' errors a pixel's t is found by.
enum class BlendSums {
  kAll,      // all around: the best picture
  kButNear,  // without itself and those beside it. With them a pixel's t follows its own noise a little, and
             // the error that is left seems less than it is: for pictures whose error is to be estimated
};

/// Replaces `base` by its blends with `finer`. `halves`: the pictures themselves.
void blend_in(const Extent& extent, const Halves& halves, const Halves& finer, BlendSums sums, int threads,
              Halves* base);

}  // namespace lightmill::denoise
