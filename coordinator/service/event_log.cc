#include "coordinator/service/event_log.h"

#include <chrono>

namespace lightmill {

void EventLog::add(std::string text) {
  if (text.size() > kMaxLineBytes) text.resize(kMaxLineBytes);
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const std::lock_guard lock(mutex_);
  lines_.push_back({++newest_, std::chrono::duration<double>(now).count(), std::move(text)});
  if (lines_.size() > kMaxLines) lines_.pop_front();
}

std::vector<EventLog::Line> EventLog::after(uint64_t number) const {
  const std::lock_guard lock(mutex_);
  if (number >= newest_) return {};
  const uint64_t wanted = newest_ - number;
  const size_t skipped = wanted < lines_.size() ? lines_.size() - static_cast<size_t>(wanted) : 0;
  return {lines_.begin() + static_cast<std::ptrdiff_t>(skipped), lines_.end()};
}

uint64_t EventLog::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

}  // namespace lightmill
