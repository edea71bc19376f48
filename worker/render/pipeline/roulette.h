#pragma once
// Russian roulette: how probable it is at most that a path goes on.
//
// A path survives a scattering event with the loss of throughput there, so that its throughput stays what it
// was: under an albedo rho it has 1 / (1 - rho) events on average. Where nothing is lost it would never end.
// So from kRouletteCapStart = K on, survival of event n is at most 1 - 2 / n: a path then gets to event n
// with probability P(n) <= (K / n)^2, and has 2 K events on average however little is lost.
//
// The variance stays finite for every albedo below 1: the throughput at event n is rho^n / P(n), and of a
// light that adds 1 per event the estimate has the second moment
//   2 / (1 - rho) * sum_n rho^(2n) / P(n),   P(n) ~ n^-2.
// A constant cap q in place of 1 - 2 / n would make P(n) geometric, and the sum infinite once rho^2 >= q.
//
// Roulette of connections: a contribution that is small against what the scene's light would leave with is
// kept with a probability that goes with its size.
#include <algorithm>

namespace lightmill {

/// What is lit by a lamp a billion times weaker than another one may be all that a pixel has.
inline constexpr float kLeastSurvival = 1.0f / 16;
/// How probable it is that a contribution of `size`, over that from which none is lost, is kept.
inline float connection_survival(float size) { return std::clamp(size, kLeastSurvival, 1.0f); }
/// The size of what plays no roulette; a product of it with any plan's factor is above 1 and finite.
inline constexpr float kNoRoulette = 0x1p60f;

/// Scattering events before Russian roulette starts. Against this start, and survival as the loss of
/// throughput, on six scenes by the efficiency of pt and auto: start at 0 0.69 to 1.09, at 2 0.77 to 1.05, at
/// 3 0.64 to 1.04; survival times 0.7 0.2 to 0.8, times 1.3 0.83 to 1.08. No other setting is better on most.
inline constexpr int kRouletteStart = 1;
inline constexpr int kRouletteCapStart = 1024;

/// Largest probability to survive scattering event `depth` (1: the first).
inline float roulette_cap(int depth) {
  return depth > kRouletteCapStart ? 1.0f - 2.0f / static_cast<float>(depth) : 1.0f;
}

}  // namespace lightmill
