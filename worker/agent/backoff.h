#pragma once
// Jittered exponential backoff: waits grow from 0.1 s to 5 s, each drawn from the upper half of its step, so
// that a restarted coordinator is not met by all workers at once.
#include <algorithm>
#include <random>

namespace lightmill::agent {

class Backoff {
 public:
  Backoff() : random_(std::random_device{}()) {}
  /// Seconds to wait before the next try.
  double next() {
    const double wait = step_ * std::uniform_real_distribution<double>(0.5, 1.0)(random_);
    step_ = std::min(kLargest, step_ * 2);
    return wait;
  }
  void reset() { step_ = kSmallest; }

 private:
  static constexpr double kSmallest = 0.1, kLargest = 5;
  std::minstd_rand random_;  // only waits depend on it, never a pixel
  double step_ = kSmallest;
};

}  // namespace lightmill::agent
