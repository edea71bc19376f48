#pragma once
// Bounds the memory of answers that are being sent: images and ledgers, which their readers may take slowly.
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>

namespace lightmill {

/// Thread-safe.
class AnswerMemory {
 public:
  static constexpr double kPatienceSeconds = 5;

  /// Of all answers together; a larger one comes alone.
  explicit AnswerMemory(uint64_t most) : most_(most) {}
  /// A share of `bytes` bytes, which ends with the last copy of what is returned. Waits until there is room,
  /// and calls `make_room` now and then meanwhile. Throws LimitReached after kPatienceSeconds.
  std::shared_ptr<const void> take(uint64_t bytes, const std::function<void()>& make_room);

 private:
  bool fits(uint64_t bytes) const { return taken_ == 0 || (bytes <= most_ && taken_ <= most_ - bytes); }

  const uint64_t most_;
  std::mutex mutex_;
  std::condition_variable room_;
  uint64_t taken_ = 0;  // guarded by mutex_
};

}  // namespace lightmill
