#pragma once
// Following a job to its end, and fetching its image: what watch, submit --wait and fetch share.
#include <string>

#include "client/farm_client.h"

namespace lightmill::client {

/// Shows progress until the job ends. Throws Error(kFailed) if it failed or was cancelled.
JobStatus follow(FarmClient& farm, const JobId& id, bool quiet);

/// Fetches the current image and writes it to `path` with the coordinator's metadata.
void fetch_to_file(FarmClient& farm, const JobId& id, const std::string& path, bool half, bool quiet);

}  // namespace lightmill::client
