#include "coordinator/merge/flush_queue.h"

#include <chrono>
#include <utility>

namespace lightmill {
namespace {

/// From the begin of a flush to that of the next: a lone commit is served at once, while under load many
/// share a sync, which costs as much processor time as answering a few of them.
constexpr std::chrono::milliseconds kLeastSpacing(2);

}  // namespace

FlushQueue::FlushQueue(std::function<void()> make_durable)
    : make_durable_(std::move(make_durable)), thread_([this] { work(); }) {}

FlushQueue::~FlushQueue() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void FlushQueue::when_durable(Waiter waiter) {
  bool first = false;
  {
    const std::lock_guard lock(mutex_);
    first = waiting_.empty();
    waiting_.push_back(std::move(waiter));
  }
  if (first) wake_.notify_one();
}

void FlushQueue::work() {
  std::vector<Waiter> served;
  std::chrono::steady_clock::time_point next;
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [this] { return ending_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    wake_.wait_until(lock, next, [this] { return ending_; });
    next = std::chrono::steady_clock::now() + kLeastSpacing;
    served.swap(waiting_);
    lock.unlock();
    std::exception_ptr failure;
    try {
      make_durable_();
    } catch (...) {
      failure = std::current_exception();
    }
    for (const Waiter& waiter : served) waiter(failure);
    served.clear();
    lock.lock();
  }
}

}  // namespace lightmill
