#pragma once
// What a pilot can't see of heavy tails. Where light takes rare turns, the squares of contributions, over
// those of their pixels' values, are distributed about like Pareto's law of index 1: every octave of them
// adds alike to the variance, however few samples are in it. A render takes many more samples than its pilot
// and meets octaves that the pilot has not; how plans weigh such paths shows in the rarest that it has met.
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
  /// How many of the rarest of all cells stand for those that are rarer; they may be of one.
  static constexpr size_t kMost = 16;
  /// Squares below are not rare anywhere.
  static constexpr float kLeastSquare = 16;

  bool takes(float square) const {
    return square > (paths_.size() < kMost ? kLeastSquare : paths_.back().square);
  }
  /// One that it takes.
  void add(const RarePath& path);
  void scale(float factor);
  const std::vector<RarePath>& paths() const { return paths_; }

 private:
  std::vector<RarePath> paths_;
};

/// What the octaves that were not met add to the sums of variance, per plan, as the rarest paths of all
/// cells, in their order, let expect.
std::array<double, kMaxPlans> unseen_variance(const std::vector<const RarePaths*>& cells);

}  // namespace lightmill
