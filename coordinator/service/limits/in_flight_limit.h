#pragma once
// A bound on how many are inside at once.
#include <atomic>
#include <chrono>
#include <semaphore>

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

/// Waits for its turn, up to `patience`, and gives it back on every way out.
class Turn {
 public:
  Turn(std::counting_semaphore<>& turns, std::chrono::seconds patience)
      : turns_(turns), granted_(turns.try_acquire_for(patience)) {}
  ~Turn() {
    if (granted_) turns_.release();
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;
  bool granted() const { return granted_; }

 private:
  std::counting_semaphore<>& turns_;
  bool granted_;
};

}  // namespace lightmill
