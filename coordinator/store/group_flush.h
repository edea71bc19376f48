#pragma once
// Group commit: one call makes durable what several threads have written.
#include <atomic>
#include <cstdint>
#include <mutex>

namespace lightmill {

/// Thread-safe.
class GroupFlush {
 public:
  /// Returns when the first `written` transactions, as counted at the call, are durable. `make_durable(n)`
  /// makes the first n of them durable. If it throws, the caller gets that, and nothing counts as flushed.
  template <class Flush>
  void flush(const std::atomic<int64_t>& written, Flush&& make_durable) {
    const int64_t wanted = written;
    const std::lock_guard lock(mutex_);
    if (flushed_ >= wanted) return;  // the thread that held the lock before has flushed ours as well
    const int64_t covered = written;
    make_durable(covered);
    flushed_ = covered;
  }

 private:
  std::mutex mutex_;
  int64_t flushed_ = 0;  // number of transactions, from the first one, that are durable
};

}  // namespace lightmill
