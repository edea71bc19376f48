#pragma once
// What stratification will gain in the image beyond what a pilot's few samples of a pixel know of it.
#include <algorithm>
#include <cmath>

namespace lightmill {

/// Samples of one pixel are stratified within blocks of them, of 16 in an image; of a pilot's `samples` half
/// are of one block. So many times less noise than those predict has the camera layer: next to nothing where
/// the pilot's blocks are as large as the image's, with single samples a factor of about 1.4. Splats gain
/// next to nothing, but those of emitters in sight (net_noise).
inline double unseen_stratification(double samples) { return 1 + 0.8 / samples; }

/// The same where an emitter's edge crosses the pixel. Strata that the edge does not cross have no noise: of
/// n^2 it crosses some n, and the variance of n samples falls with n^1.5, here per sample.
inline double unseen_stratification_at_edges(double samples) {
  return std::sqrt(std::max(32 / samples, 1.0));
}

/// What of an unstratified sample's variance is left in blocks of 16 scrambled Sobol samples where an emitter
/// with a straight edge covers the part `covered` of the pixel: nothing is gained of slivers. Fitted to
/// simulated edges of all directions, to within 0.1 except where less than 1/40 is covered.
inline float stratified_edge(float covered) { return 1 / (1 + 32 * covered * (1 - covered)); }

/// Variance of how many points of a net fall into a square, over that of as many independent ones: `count` of
/// them on average. Of squares of the net's cells, whose places are even: those inside have a point each.
inline float net_noise(float count) {
  return count < 1 ? 1 - count * (4.0f / 9) : (2.0f / 3 * std::sqrt(count) - 1.0f / 9) / count;
}

}  // namespace lightmill
