#include "coordinator/service/stall_watch.h"

#include <algorithm>
#include <chrono>

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
    while (!ending_.wait_for(lock, pause, [&] { return ended_; })) cut_stalled();
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

void StallWatch::cut_stalled() {
  const std::lock_guard lock(mutex_);
  while (!waiting_.empty() && waiting_.begin()->first <= clock_.now()) {
    Call& call = *waiting_.begin()->second;
    waiting_.erase(waiting_.begin());
    call.waits_ = false;
    const auto cut = call.cut_;  // the call may be gone before it returns
    cut();
  }
}

void StallWatch::Call::begin() {
  const std::lock_guard lock(watch_.mutex_);
  since_ = watch_.clock_.now();
  place_ = watch_.waiting_.emplace(since_ + left_, this);
  waits_ = true;
}

void StallWatch::Call::end(size_t bytes) {
  const std::lock_guard lock(watch_.mutex_);
  if (!waits_) return;
  watch_.waiting_.erase(place_);
  waits_ = false;
  const double waited = watch_.clock_.now() - since_;
  left_ =
      std::clamp(left_ - waited + static_cast<double>(bytes) / kLeastBytesPerSecond, 0.0, watch_.seconds_);
}

}  // namespace lightmill
