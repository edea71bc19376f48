#pragma once
// Following a job to its end, and fetching its image: what watch, submit --wait and fetch share.
#include <optional>
#include <string>

#include "client/connection/farm_client.h"
#include "client/write_picture.h"

namespace lightmill::client {

/// Shows progress until the job ends, with `screen` on a terminal as a live screen with the workers, and its
/// picture at the viewer `display` (live_view.h) if that is not empty. Throws Error(kFailed) if it failed or
/// was cancelled.
JobStatus follow(FarmClient& farm, const JobId& id, bool quiet, const std::string& display = "",
                 bool screen = false);

/// Fetches the current image, with the job's AOVs if the file can hold them, and writes it with the
/// coordinator's metadata, denoised if `output` says so. `max_side` over 0: a preview (FarmClient::fetch).
/// Returns what was fetched, and in `denoised`, unless that is null, what write_picture() does.
FetchedImage fetch_to_file(FarmClient& farm, const JobId& id, const OutputOptions& output, bool quiet,
                           int max_side = 0, std::optional<DenoiseFigures>* denoised = nullptr);

}  // namespace lightmill::client
