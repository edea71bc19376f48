#include "coordinator/service/tile_log.h"

#include <algorithm>
#include <chrono>

namespace lightmill {

LogContext log_context(const WorkerId& worker, const LeaseKey& key) {
  return {key.job.value, key.tile.value, key.attempt, worker.value};
}

void TileLog::add(std::string text) {
  const LogContext& about = log_context();
  if (about.job.empty()) return;
  if (text.size() > kMaxTextBytes) text.resize(kMaxTextBytes);
  using std::chrono::system_clock;
  const double now = std::chrono::duration<double>(system_clock::now().time_since_epoch()).count();
  const std::lock_guard lock(mutex_);
  lines_.push_back({now, about, std::move(text)});
  if (lines_.size() > kMaxLines) lines_.pop_front();
}

std::vector<TileLog::Line> TileLog::of(const JobId& job, const std::optional<TileId>& tile,
                                       size_t most) const {
  std::vector<Line> found;
  const std::lock_guard lock(mutex_);
  for (auto line = lines_.rbegin(); line != lines_.rend() && found.size() < most; ++line) {
    if (line->about.job == job.value && (!tile || line->about.tile == tile->value)) found.push_back(*line);
  }
  std::reverse(found.begin(), found.end());
  return found;
}

}  // namespace lightmill
