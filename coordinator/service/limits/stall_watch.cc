#include "coordinator/service/limits/stall_watch.h"

#include <algorithm>
#include <chrono>
#include <limits>

namespace lightmill {
namespace {

constexpr double kLooksPerPatience = 10;
constexpr double kLongestPause = 1;  // seconds

}  // namespace

StallWatch::StallWatch(const Clock& clock, double seconds, bool by_itself)
    : clock_(clock), seconds_(seconds) {
  if (!by_itself) return;
  thread_ = std::thread([this] {
    const std::chrono::duration<double> pause(std::min(kLongestPause, seconds_ / kLooksPerPatience));
    std::unique_lock lock(mutex_);
    while (!ending_.wait_for(lock, pause, [&] { return ended_; })) {
      lock.unlock();
      cut_stalled();
      lock.lock();
    }
  });
}

StallWatch::~StallWatch() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  ending_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void StallWatch::cut(std::unique_lock<std::mutex>& lock, Call* call) {
  if (call->waits_) waiting_.erase(call->place_);
  call->waits_ = false;
  call->was_cut_ = true;
  const std::shared_ptr<Cut> cut = call->cut_;
  cut->by = std::this_thread::get_id();
  lock.unlock();
  cut->cancel();
  lock.lock();
  cut->by.reset();
  cut_done_.notify_all();
}

void StallWatch::cut_stalled() {
  std::unique_lock lock(mutex_);
  while (!waiting_.empty() && waiting_.begin()->first <= clock_.now()) cut(lock, waiting_.begin()->second);
}

StallWatch::Call* StallWatch::Group::slowest(double rate) const {
  const double now = watch_.clock_.now();
  Call* found = nullptr;
  for (Call* call : calls_) {
    if (call->was_cut_ || now - call->begun_ < kGraceSeconds) continue;
    const double its_rate = call->bytes_ / std::max(call->waited(now), 1e-3);
    if (its_rate > rate) continue;
    found = call;
    rate = its_rate;
  }
  return found;
}

bool StallWatch::Group::cut_slowest(double rate) {
  std::unique_lock lock(watch_.mutex_);
  Call* const call = slowest(rate);
  if (call) watch_.cut(lock, call);
  return call;
}

void StallWatch::Call::enter() {
  if (!group_) return;
  std::unique_lock lock(watch_.mutex_);
  begun_ = watch_.clock_.now();
  const size_t count = group_->calls_.size();
  Call* const other =
      count < group_->most_ ? nullptr : group_->slowest(std::numeric_limits<double>::infinity());
  // Those that are being cut need a moment to end.
  admitted_ = count < group_->most_ || (other && count < 2 * group_->most_);
  if (!admitted_) return;
  group_->calls_.insert(this);
  if (other) watch_.cut(lock, other);
}

StallWatch::Call::~Call() {
  end(0);
  std::unique_lock lock(watch_.mutex_);
  if (group_) group_->calls_.erase(this);
  watch_.cut_done_.wait(lock, [&] { return !cut_->by || cut_->by == std::this_thread::get_id(); });
}

void StallWatch::Call::begin() {
  const std::lock_guard lock(watch_.mutex_);
  since_ = watch_.clock_.now();
  place_ = watch_.waiting_.emplace(since_ + left_, this);
  waits_ = true;
}

void StallWatch::Call::end(size_t bytes) {
  const std::lock_guard lock(watch_.mutex_);
  bytes_ += static_cast<double>(bytes);
  if (!waits_) return;
  watch_.waiting_.erase(place_);
  waits_ = false;
  const double waited = watch_.clock_.now() - since_;
  waited_ += waited;
  left_ =
      std::clamp(left_ - waited + static_cast<double>(bytes) / kLeastBytesPerSecond, 0.0, watch_.seconds_);
}

}  // namespace lightmill
