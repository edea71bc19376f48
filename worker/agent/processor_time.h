#pragma once
// Processor time of a stretch of work that has threads of its own.
#include <algorithm>
#include <chrono>
#include <ctime>

namespace lightmill::agent {

/// Processor time of what runs on `threads` threads from now on. Tiles that are still being finished beside
/// it count too, but never more than these threads could have used.
class ProcessorTime {
 public:
  explicit ProcessorTime(int threads) : threads_(threads) {}
  double seconds() const {
    const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    const double used = static_cast<double>(std::clock() - used_) / CLOCKS_PER_SEC;
    return std::clamp(used, 0.0, wall * threads_);
  }

 private:
  int threads_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::clock_t used_ = std::clock();
};

}  // namespace lightmill::agent
