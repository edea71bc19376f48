#pragma once
// What the dashboard is told, as JSON. Keys are described in docs/dashboard.md; numbers have six digits, so
// that noise in the last ones is no change.
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "common/error/error_curve.h"
#include "coordinator/core/farm.h"
#include "coordinator/service/event_log.h"
#include "coordinator/service/tile_log.h"

namespace lightmill {

/// A row of the list of jobs.
nlohmann::json job_view(const JobStatus& job);
/// What the row lacks: settings, scene, counters, and the pilot's report where there is one.
nlohmann::json job_detail_view(const JobStatus& job, const std::optional<PilotReport>& pilot);
/// `held`: what the worker renders now.
nlohmann::json worker_view(const WorkerStatus& worker, const std::vector<LeaseKey>& held);
/// Spans are [job, cell, cells, busy seconds, tiles].
nlohmann::json timeline_view(const TimelinePage& page);
/// Points [from, end).
nlohmann::json curve_view(const ErrorCurve& curve, size_t from = 0);
nlohmann::json tile_view(const TileStatus& tile);
nlohmann::json tile_log_view(const std::vector<TileLog::Line>& lines);
nlohmann::json log_view(const std::vector<EventLog::Line>& lines);
/// Six digits; JSON has no infinity and no NaN: null.
nlohmann::json json_number(double value);
/// Text that came from outside may not be UTF-8: what is not is replaced.
std::string json_text(const nlohmann::json& value);

}  // namespace lightmill
