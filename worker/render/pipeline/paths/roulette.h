#pragma once
// Russian roulette: the largest probability with which a path goes on.
//
// A path survives a scattering event with the loss of throughput there, so its throughput stays what it was:
// under an albedo rho it has 1 / (1 - rho) events on average. Where nothing is lost it would never end. So
// from kRouletteCapStart = K on, survival of event n is at most 1 - 2 / n. A path then gets to event n with
// probability P(n) <= (K / n)^2, and has 2 K events on average however little is lost.
//
// The variance stays finite for every albedo below 1. The throughput at event n is rho^n / P(n). For a light
// that adds 1 per event, the estimate's second moment is
//   2 / (1 - rho) * sum_n rho^(2n) / P(n),   P(n) ~ n^-2.
// A constant cap q in place of 1 - 2 / n would make P(n) geometric, and the sum infinite once rho^2 >= q.
//
// Roulette of connections: a contribution that is small against the scene's light is kept with a probability
// in proportion to its size.
#include <algorithm>

#include "common/job/sampling_plan.h"

namespace lightmill {

/// Not smaller: the light of a lamp a billion times weaker than another one may be all that a pixel has.
inline constexpr float kLeastSurvival = 1.0f / 16;
/// Probability that a contribution is kept. `size`: over that from which on none is lost.
inline float connection_survival(float size) { return std::clamp(size, kLeastSurvival, 1.0f); }
/// The size of what plays no roulette. Its product with any plan's factor is above 1 and finite.
inline constexpr float kNoRoulette = 0x1p60f;

/// The first scattering event of light paths that plays roulette; that of camera paths is
/// SamplingPlan::rr_depth. Other settings for both were tried on six rooms, by the efficiency of pt and auto
/// relative to this one and to survival by the loss of throughput: from event 1 on 0.69 to 1.09, from 3 0.77
/// to 1.05, from 4 0.64 to 1.04; survival times 0.7 0.2 to 0.8, times 1.3 0.83 to 1.08. None is better on
/// most.
inline constexpr int kLightRrDepth = kLeastRrDepth;
inline constexpr int kRouletteCapStart = 1024;

/// Largest probability to survive scattering event `depth` (1: the first).
inline float roulette_cap(int depth) {
  return depth > kRouletteCapStart ? 1.0f - 2.0f / static_cast<float>(depth) : 1.0f;
}

}  // namespace lightmill
