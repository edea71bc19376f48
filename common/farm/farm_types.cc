#include "common/farm/farm_types.h"

#include <stdexcept>

namespace lightmill {

const char* job_state_name(JobState state) {
  switch (state) {
    case JobState::kQueued:
      return "queued";
    case JobState::kRunning:
      return "running";
    case JobState::kPaused:
      return "paused";
    case JobState::kDone:
      return "done";
    case JobState::kFailed:
      return "failed";
    case JobState::kCancelled:
      return "cancelled";
  }
  throw std::logic_error("unknown job state");
}

std::optional<JobState> job_state_from_name(const std::string& name) {
  for (JobState state : {JobState::kQueued, JobState::kRunning, JobState::kPaused, JobState::kDone,
                         JobState::kFailed, JobState::kCancelled}) {
    if (name == job_state_name(state)) return state;
  }
  return std::nullopt;
}

}  // namespace lightmill
