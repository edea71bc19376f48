#pragma once
// A bound on how many are inside at once.
#include <atomic>

namespace lightmill {

/// Counts those inside, and releases on every way out. A caller that is not `granted` must turn back, or at
/// least not wait.
class Slot {
 public:
  Slot(std::atomic<int>& count, int limit) : count_(count), granted_(++count <= limit) {}
  ~Slot() { --count_; }
  Slot(const Slot&) = delete;
  Slot& operator=(const Slot&) = delete;
  bool granted() const { return granted_; }

 private:
  std::atomic<int>& count_;
  bool granted_;
};

}  // namespace lightmill
