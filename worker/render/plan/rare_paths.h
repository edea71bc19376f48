#pragma once
// Estimates the heavy tails that a pilot can't see. Where light takes rare turns, squares of contributions
// over those of their pixels' values follow about Pareto's law of index 1: every octave of them adds as much
// to the variance, however few samples are in it. A render takes many more samples than its pilot and meets
// octaves that the pilot has not. How plans weigh such paths shows in the rarest that the pilot met.
#include <array>
#include <vector>

#include "worker/render/plan/plan_set.h"

namespace lightmill {

/// A contribution: its square in the recorded plan, relative to its pixel's value and summed over channels,
/// and what it adds to the variance under each plan.
struct RarePath {
  float square = 0;
  PerPlan variance{};
};

/// The rarest paths of one cell, by falling squares.
class RarePaths {
 public:
  /// This many of the rarest paths of all cells stand for those that are rarer. All may be of one cell.
  static constexpr size_t kMost = 16;
  /// Smaller squares are not rare anywhere.
  static constexpr float kLeastSquare = 16;

  bool takes(float square) const {
    return square > (paths_.size() < kMost ? kLeastSquare : paths_.back().square);
  }
  /// Adds a path. takes() must be true for its square.
  void add(const RarePath& path);
  void scale(float factor);
  const std::vector<RarePath>& paths() const { return paths_; }

 private:
  std::vector<RarePath> paths_;
};

/// What the octaves that were not met add to the sums of variance, per plan: extrapolated from the rarest
/// paths of all cells, in their order.
std::array<double, kMaxPlans> unseen_variance(const std::vector<const RarePaths*>& cells);

}  // namespace lightmill
