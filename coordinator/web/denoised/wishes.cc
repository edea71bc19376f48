#include "coordinator/web/denoised/wishes.h"

#include <algorithm>

namespace lightmill {

void Wishes::add(const JobId& job) {
  std::erase(wanted_, job);
  wanted_.push_back(job);
  if (wanted_.size() > kMost) wanted_.pop_front();
}

std::optional<JobId> Wishes::take() {
  if (wanted_.empty()) return std::nullopt;
  const auto turn = [&](const JobId& job) {
    const auto last = std::find(turns_.begin(), turns_.end(), job);
    return last == turns_.end() ? -1 : last - turns_.begin();
  };
  const auto next = std::min_element(wanted_.rbegin(), wanted_.rend(),
                                     [&](const JobId& a, const JobId& b) { return turn(a) < turn(b); });
  const JobId job = *next;
  std::erase(wanted_, job);
  std::erase(turns_, job);
  turns_.push_back(job);
  if (turns_.size() > kRemembered) turns_.pop_front();
  return job;
}

}  // namespace lightmill
