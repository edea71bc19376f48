#pragma once
// Answers that wait for the disk without a thread each (group commit). One thread makes durable what was
// written, then calls those that waited for it. Those that come meanwhile share the next turn.
//
//   FlushQueue queue([&] { farm.flush(); });
//   queue.when_durable([=](std::exception_ptr failure) { reactor->Finish(...); });
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace lightmill {

/// Thread-safe.
class FlushQueue {
 public:
  /// Called on the queue's thread: with null, or with the reason why what was written before is not durable.
  /// Must not throw.
  using Waiter = std::function<void(std::exception_ptr failure)>;

  /// `make_durable` makes everything durable that was written before it is called, or throws.
  explicit FlushQueue(std::function<void()> make_durable);
  /// Serves those that wait, then ends.
  ~FlushQueue();
  FlushQueue(const FlushQueue&) = delete;
  FlushQueue& operator=(const FlushQueue&) = delete;
  /// Calls `waiter` once what was written before this call is durable.
  void when_durable(Waiter waiter);

 private:
  void work();

  const std::function<void()> make_durable_;
  std::mutex mutex_;
  std::condition_variable wake_;
  // Guarded by mutex_.
  std::vector<Waiter> waiting_;
  bool ending_ = false;
  std::thread thread_;  // last: uses what is above
};

}  // namespace lightmill
