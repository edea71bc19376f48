#include "coordinator/store/storage_health.h"

#include <algorithm>

namespace lightmill {

void StorageHealth::failed(const std::string& reason, double now) {
  const std::lock_guard lock(mutex_);
  if (fault_) return;
  fault_ = reason;
  pause_ = kFirstProbeSeconds;
  next_probe_ = now + pause_;
}

bool StorageHealth::mended() {
  const std::lock_guard lock(mutex_);
  const bool was = fault_.has_value();
  fault_.reset();
  return was;
}

std::optional<std::string> StorageHealth::fault() const {
  const std::lock_guard lock(mutex_);
  return fault_;
}

bool StorageHealth::take_probe(double now) {
  const std::lock_guard lock(mutex_);
  // A clock that was set back must not postpone the probe for as long as it went back.
  if (!fault_ || (now < next_probe_ && next_probe_ - now <= kLongestProbeSeconds)) return false;
  pause_ = std::min(kLongestProbeSeconds, pause_ * 2);
  next_probe_ = now + pause_;
  return true;
}

}  // namespace lightmill
