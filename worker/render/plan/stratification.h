#pragma once
// What stratification gains in the image beyond what a pilot's few samples of a pixel show.
#include <algorithm>
#include <cmath>

namespace lightmill {

/// Factor by which the camera layer has less noise than a pilot's samples predict. Samples of one pixel are
/// stratified within blocks, of 16 in an image; of a pilot's `samples`, half are of one block. The factor is
/// next to 1 where the pilot's blocks are as large as the image's, and about 1.4 with single samples. Splats
/// gain next to nothing, but those of visible emitters do (net_noise).
inline double unseen_stratification(double samples) { return 1 + 0.8 / samples; }

/// The same where an emitter's edge crosses the pixel. Strata that the edge does not cross have no noise. Of
/// N strata it crosses about sqrt(N), so the variance falls with N^1.5, which is N^0.5 per sample.
inline double unseen_stratification_at_edges(double samples) {
  return std::sqrt(std::max(32 / samples, 1.0));
}

/// The part of an unstratified sample's variance that is left in blocks of 16 scrambled Sobol samples, where
/// an emitter with a straight edge covers the part `covered` of the pixel. For slivers nothing is gained.
/// Fitted to simulated edges of all directions, to within 0.1 except where less than 1/40 is covered.
inline float stratified_edge(float covered) { return 1 / (1 + 32 * covered * (1 - covered)); }

/// Variance of the number of points of a low-discrepancy net in a square, over that of as many independent
/// points: `count` of them on average. The net is taken as square cells of one point each, and all places of
/// the square over them as equally likely. So cells inside the square add nothing.
inline float net_noise(float count) {
  return count < 1 ? 1 - count * (4.0f / 9) : (2.0f / 3 * std::sqrt(count) - 1.0f / 9) / count;
}

}  // namespace lightmill
