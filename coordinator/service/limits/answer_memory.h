#pragma once
// Bounds the memory of answers that are being sent: images and ledgers, which their readers may take slowly.
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>

namespace lightmill {

/// Thread-safe.
class AnswerMemory {
 public:
  static constexpr double kPatienceSeconds = 5;

  /// `most`: bytes of all answers together; a larger one comes alone. `make_room` is called now and then
  /// while somebody waits.
  AnswerMemory(uint64_t most, std::function<void()> make_room)
      : most_(most), make_room_(std::move(make_room)) {}
  /// A share of `bytes` bytes, which ends with the last copy of what is returned. Waits until there is room.
  /// Throws LimitReached after kPatienceSeconds.
  std::shared_ptr<const void> take(uint64_t bytes);

 private:
  bool fits(uint64_t bytes) const { return taken_ == 0 || (bytes <= most_ && taken_ <= most_ - bytes); }

  const uint64_t most_;
  const std::function<void()> make_room_;
  std::mutex mutex_;
  std::condition_variable room_;
  uint64_t taken_ = 0;  // guarded by mutex_
};

}  // namespace lightmill
