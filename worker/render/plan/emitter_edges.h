#pragma once
// How much less noise low-discrepancy points make where a visible emitter covers a part of a pixel. A pilot's
// few samples miss emitters that cover little of one, and light paths find them.
#include <algorithm>
#include <cmath>

namespace lightmill {

/// Noise of an emitter's edge that crosses the pixel, of one of `samples` low-discrepancy samples, over that
/// of one of as many others: as stratified_edge for large emitters.
inline float noise_at_edges(float samples) { return 1 / std::sqrt(samples); }

/// The part of an independent sample's variance that is left in `samples` scrambled Sobol' samples, where an
/// emitter with a straight edge covers the part `covered` of the pixel. The edge crosses about sqrt(n) of n
/// strata, and the others have no noise. For slivers nothing is gained. With 16 samples fitted to simulated
/// edges of all directions, to within 0.1 except where less than 1/40 is covered.
inline float stratified_edge(float covered, float samples) {
  return 1 / (1 + 8 * covered * (1 - covered) / noise_at_edges(samples));
}

/// Variance of the number of points of a low-discrepancy net in a square, over that of as many independent
/// points: `count` of them on average. The net is taken as square cells of one point each, and all places of
/// the square over them as equally likely. So cells inside the square add nothing.
inline float net_noise(float count) {
  return count < 1 ? 1 - count * (4.0f / 9) : (2.0f / 3 * std::sqrt(count) - 1.0f / 9) / count;
}

}  // namespace lightmill
