#pragma once
// What the dashboard may change: from a JSON body to a call of the farm.
#include <string>

#include "coordinator/web/web_api.h"

namespace lightmill {

/// The names: "pause", "resume", "cancel", "retry", "extend", "priority", "resubmit".
const std::vector<std::string>& action_names();

/// Does it and returns the job's id, of "resubmit" the new one's. The body is a JSON object with, for
/// "extend", "spp", "time_seconds" and "target_error" (new totals), for "priority" "priority", and for
/// "resubmit", which submits the job's scene again, what shall differ: those of both, "name", "pool" and
/// "seed". `user` counts towards the submission quota. Throws Error(kUsage) for a body that is wrong, and
/// what the farm throws.
JobId act(const WebOptions& web, const std::string& action, const JobId& job, const std::string& body,
          const std::string& user);

/// The same without "resubmit", and to all frames of a sequence.
const std::vector<std::string>& sequence_action_names();
void act(const WebOptions& web, const std::string& action, const SequenceId& sequence,
         const std::string& body);

}  // namespace lightmill
