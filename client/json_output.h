#pragma once
// The shapes that verbs print with --json. Keys may be added but are never taken away.
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "coordinator/core/farm.h"

namespace lightmill::client {

/// relmse, relmse_4 and so on (common/error/box_figures.h), and their intervals are null while unknown.
nlohmann::json job_to_json(const JobStatus& status);
/// Null without a pilot's report.
nlohmann::json pilot_document(const std::optional<PilotReport>& pilot);
nlohmann::json sequence_to_json(const SequenceStatus& sequence);
nlohmann::json frame_to_json(const FrameStatus& frame);
nlohmann::json tile_to_json(const TileStatus& tile);
nlohmann::json worker_to_json(const WorkerStatus& worker);
/// Indented; bytes that are not UTF-8 (names are free text) are replaced.
std::string dump(nlohmann::json document);

}  // namespace lightmill::client
