#pragma once
// What a picture of a job shows: another one is needed once this changes.
#include <string>

#include "common/farm/farm_types.h"

namespace lightmill {

/// Letters, digits and "-"; the same after a restart.
inline std::string film_mark(const JobStatus& job) {
  return std::to_string(job.packets_done) + "-" + std::to_string(job.commit_bytes);
}

}  // namespace lightmill
