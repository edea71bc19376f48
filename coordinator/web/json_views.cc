#include "coordinator/web/json_views.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "common/error/box_figures.h"
#include "common/farm/pilot_result.h"
#include "common/film/dropped_text.h"

namespace lightmill {
namespace {

using nlohmann::json;

json number(double value) { return json_number(value); }

void put(json* object, const char* key, const std::optional<double>& value) {
  if (value) (*object)[key] = number(*value);
}

/// The kinds that there are, with their counts and shares, and what to say of them.
void put_dropped(json* row, const JobStatus& job) {
  for (size_t i = 0; i < kDropKinds; ++i) {
    const DroppedShare& dropped = job.dropped[i];
    if (dropped.count == 0) continue;
    json& kind = (*row)["dropped"][drop_kind_name(static_cast<DropKind>(i))];
    kind = {{"count", dropped.count}};
    put(&kind, "share", dropped.share);
  }
  for (const DroppedLine& line : dropped_lines(job.dropped, job.counters.nonfinite))
    (*row)["dropped_lines"].push_back({{"text", line.text}, {"warning", line.warning}});
}

}  // namespace

json job_view(const JobStatus& job) {
  const RenderSettings& settings = job.settings;
  json row = {{"id", job.id.value},
              {"version", job.version},
              {"name", job.name},
              {"state", job_state_name(job.state)},
              {"priority", job.priority},
              {"packets_done", job.packets_done},
              {"packets_total", job.packets_total},
              {"spp", number(job.spp)},
              {"wall_seconds", number(job.wall_seconds)},
              {"cpu_seconds", number(job.cpu_seconds)},
              {"rate", number(job.samples_per_second)},
              {"eta_seconds", number(job.eta_seconds)},
              {"workers", job.workers},
              {"tiles_leased", job.tiles_leased},
              {"width", settings.grid.crop.width()},
              {"height", settings.grid.crop.height()},
              {"sampling", sampling_text(settings)},
              {"nonfinite", job.counters.nonfinite},
              {"leases_reassigned", job.leases_reassigned}};
  if (!job.message.empty()) row["message"] = job.message;
  if (!job.waiting.empty()) row["waiting"] = job.waiting;
  if (!job.waits_behind.empty()) row["waits_behind"] = job.waits_behind.value;
  if (job.turn_seconds >= 0) row["turn_seconds"] = number(job.turn_seconds);
  if (!job.pool.empty()) row["pool"] = job.pool;
  if (!job.submitter.empty()) row["submitter"] = job.submitter;
  if (job.max_workers > 0) row["max_workers"] = job.max_workers;
  for (const JobId& id : job.after) row["after"].push_back(id.value);
  if (settings.spp < kMaxSpp) row["spp_total"] = settings.spp;
  if (settings.time_s > 0) row["time_limit"] = number(settings.time_s);
  if (settings.target_error > 0) row["target_error"] = number(settings.target_error);
  if (settings.target_denoised) row["target_denoised"] = true;
  put_dropped(&row, job);
  put(&row, "relmse", job.relmse);
  put(&row, "relmse_low", job.relmse_low);
  put(&row, "relmse_high", job.relmse_high);
  put(&row, "denoised_relmse", job.denoised_relmse);
  put(&row, "denoised_relmse_low", job.denoised_relmse_low);
  put(&row, "denoised_relmse_high", job.denoised_relmse_high);
  for (const BoxFigure& figure : box_estimates()) put(&row, figure.name.c_str(), figure.of(job.boxes));
  return row;
}

json job_detail_view(const JobStatus& job, const std::optional<PilotReport>& pilot) {
  const FilmGrid& grid = job.settings.grid;
  const RenderCounters& counters = job.counters;
  json detail = {{"settings", json::parse(settings_to_json(job.settings))},
                 {"scene", job.bundle_digest},
                 {"crop", {grid.crop.x0, grid.crop.y0, grid.crop.x1, grid.crop.y1}},
                 {"cell_pixels", kCellSize},
                 {"tiles_committed", job.tiles_committed},
                 {"camera_paths", counters.camera_paths},
                 {"light_paths", counters.light_paths}};
  if (!job.missing_light.empty()) detail["missing_light"] = job.missing_light;
  if (pilot) detail["pilot"] = json::parse(pilot_to_json(*pilot));
  return detail;
}

json worker_view(const WorkerStatus& worker, const std::vector<LeaseKey>& held) {
  const WorkerRegistration& registration = worker.registration;
  json row = {{"id", worker.id.value},
              {"host", registration.host},
              {"threads", registration.threads},
              {"pool", registration.pool},
              {"class", registration.arithmetic_class.substr(0, 12)},
              {"build", registration.build},
              {"state", worker.state},
              {"tiles", worker.tiles_committed},
              {"rate", number(worker.samples_per_second)},
              {"refused", worker.partials_refused}};
  // Healthy workers are heard of all the time; only silence is news.
  constexpr double kSilenceSeconds = 5;
  row["silent_seconds"] =
      worker.seconds_since_seen < kSilenceSeconds ? 0 : std::floor(worker.seconds_since_seen);
  auto tiles = json::array();
  for (const LeaseKey& key : held) tiles.push_back({key.job.value, key.tile.value, key.attempt});
  row["held"] = std::move(tiles);
  return row;
}

json timeline_view(const TimelinePage& page) {
  json view = {{"cell", page.cell},
               {"cell_seconds", WorkerActivity::kCellSeconds},
               {"cells", WorkerActivity::kCells},
               {"origin", page.cell_origin}};
  if (!page.last.empty()) view["next"] = page.last.value;
  json& workers = view["workers"] = json::array();
  for (const WorkerTimeline& worker : page.workers) {
    auto spans = json::array();
    for (const WorkerActivity::Span& s : worker.spans)
      spans.push_back({s.job.value, s.cell, s.cells, number(s.busy_seconds), s.tiles});
    workers.push_back({{"id", worker.id.value},
                       {"present_seconds", number(worker.present_seconds)},
                       {"busy_seconds", number(worker.busy_seconds)},
                       {"spans", std::move(spans)}});
  }
  return view;
}

json curve_view(const ErrorCurve& curve, size_t from) {
  auto points = json::array();
  for (size_t i = from; i < curve.points.size(); ++i) {
    const ErrorPoint& p = curve.points[i];
    json point = {{"wall_seconds", number(p.wall_seconds)},
                  {"cpu_seconds", number(p.cpu_seconds)},
                  {"spp", number(p.spp)},
                  {"batches", p.batches}};
    put(&point, "relmse", p.relmse);
    put(&point, "relmse_low", p.relmse_low);
    put(&point, "relmse_high", p.relmse_high);
    put(&point, "denoised_relmse", p.denoised_relmse);
    put(&point, "denoised_relmse_low", p.denoised_relmse_low);
    put(&point, "denoised_relmse_high", p.denoised_relmse_high);
    put(&point, "true_relmse", p.true_relmse);
    put(&point, "true_flip", p.true_flip);
    for (const BoxFigure& figure : box_figures()) put(&point, figure.name.c_str(), figure.of(p.boxes));
    points.push_back(std::move(point));
  }
  return points;
}

json tile_view(const TileStatus& tile) {
  json view = {{"id", tile.id.value}, {"state", tile.state}, {"attempt", tile.attempt}};
  if (!tile.worker.empty()) view["worker"] = tile.worker.value;
  if (is_pilot(tile.tile)) {
    view["pilot"] = true;
  } else {
    const CellRect& c = tile.tile.cells;
    view["cells"] = {c.x0, c.y0, c.x1, c.y1};
    view["samples"] = {tile.tile.sample_begin, tile.tile.sample_end};
  }
  return view;
}

json tile_log_view(const std::vector<TileLog::Line>& lines) {
  auto view = json::array();
  for (const TileLog::Line& line : lines) {
    view.push_back({{"time", line.time},
                    {"tile", line.about.tile},
                    {"attempt", line.about.attempt},
                    {"worker", line.about.worker},
                    {"text", line.text}});
  }
  return view;
}

json log_view(const std::vector<EventLog::Line>& lines) {
  auto view = json::array();
  for (const EventLog::Line& line : lines) {
    view.push_back({{"number", line.number}, {"time", line.time}, {"text", line.text}});
  }
  return view;
}

json json_number(double value) {
  if (!std::isfinite(value)) return nullptr;
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return std::strtod(text, nullptr);
}

std::string json_text(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace lightmill
