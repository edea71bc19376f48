#pragma once
// Sequences for the dashboard: JSON under /api/v1/sequences. docs/dashboard.md describes it. Every route has
// a line in coordinator/access/access.cc.
#include <httplib.h>

#include <string>
#include <vector>

#include "coordinator/web/web_api.h"

namespace lightmill {

/// The list, one sequence, its frames, and what may be done to it.
std::vector<WebApi::Route> sequence_routes();

/// Answers a request to one of them, whose first match is the sequence's id. `user` did it, for the log.
/// Throws UnknownSequence, Error(kUsage), and what the farm throws.
void answer_sequence(const WebOptions& web, const std::string& user, const httplib::Request& request,
                     httplib::Response& response);

}  // namespace lightmill
