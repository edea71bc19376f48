#pragma once
// Group commit: what several threads have written becomes durable by one call for all of them.
#include <atomic>
#include <cstdint>
#include <mutex>

namespace lightmill {

/// Thread-safe.
class GroupFlush {
 public:
  /// Returns when the first `written` transactions, as counted at the call, are durable. `make_durable(n)`
  /// makes the first n of them durable; what it throws goes to the caller, and nothing counts as flushed.
  template <class Flush>
  void flush(const std::atomic<int64_t>& written, Flush&& make_durable) {
    const int64_t wanted = written;
    const std::lock_guard lock(mutex_);
    if (flushed_ >= wanted) return;  // whoever held the lock before has flushed ours as well
    const int64_t covered = written;
    make_durable(covered);
    flushed_ = covered;
  }

 private:
  std::mutex mutex_;
  int64_t flushed_ = 0;  // the first so many transactions are durable
};

}  // namespace lightmill
