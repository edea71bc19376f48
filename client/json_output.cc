#include "client/json_output.h"

#include <nlohmann/json.hpp>

#include "client/terminal/progress.h"
#include "common/base/json/json_aliases.h"
#include "common/error/box_figures.h"
#include "common/farm/pilot_result.h"

namespace lightmill::client {
namespace {

nlohmann::json optional_number(const std::optional<double>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json(nullptr);
}

nlohmann::json dropped_to_json(const DroppedShares& dropped) {
  nlohmann::json kinds;
  for (size_t i = 0; i < kDropKinds; ++i) {
    kinds[drop_kind_name(static_cast<DropKind>(i))] = {{"count", dropped[i].count},
                                                       {"share", optional_number(dropped[i].share)}};
  }
  return kinds;
}

}  // namespace

nlohmann::json sequence_to_json(const SequenceStatus& s) {
  nlohmann::json after = nlohmann::json::array(), frames;
  for (const JobId& id : s.request.after) after.push_back(id.value);
  for (int state = 0; state < 6; ++state)
    frames[job_state_name(static_cast<JobState>(state))] = s.frames[state];
  const SequenceRequest& r = s.request;
  return {
      {"id", s.id.value},
      {"name", r.name},
      {"state", job_state_name(s.state)},
      {"message", s.message},
      {"priority", r.priority},
      {"pool", r.pool},
      {"submitter", r.submitter},
      {"max_workers", r.max_workers == 0 ? nlohmann::json(nullptr) : nlohmann::json(r.max_workers)},
      {"deadline", r.deadline > 0 ? nlohmann::json(r.deadline) : nlohmann::json(nullptr)},
      {"after", std::move(after)},
      {"order", frame_order_name(r.order)},
      {"fps", r.fps},
      {"budget_seconds", r.budget_seconds > 0 ? nlohmann::json(r.budget_seconds) : nlohmann::json(nullptr)},
      {"frame_count", s.frame_count},
      {"frames", std::move(frames)},
      {"first_frame", s.first_frame},
      {"last_frame", s.last_frame},
      {"packets_done", s.packets_done},
      {"packets_total", s.packets_total},
      {"wall_seconds", s.wall_seconds},
      {"cpu_seconds", s.cpu_seconds},
      {"samples_per_second", s.samples_per_second},
      {"eta_seconds", s.eta_seconds < 0 ? nlohmann::json(nullptr) : nlohmann::json(s.eta_seconds)},
      {"relmse_mean", optional_number(s.relmse_mean)},
      {"relmse_max", optional_number(s.relmse_max)},
      {"workers", s.workers}};
}

nlohmann::json frame_to_json(const FrameStatus& s) {
  return {{"frame", s.number},
          {"id", s.job.value},
          {"state", job_state_name(s.state)},
          {"message", s.message},
          {"scene", s.bundle_digest},
          {"spp", s.spp},
          {"packets_done", s.packets_done},
          {"packets_total", s.packets_total},
          {"wall_seconds", s.wall_seconds},
          {"cpu_seconds", s.cpu_seconds},
          {"relmse", optional_number(s.relmse)},
          {"relmse_low", optional_number(s.relmse_low)},
          {"relmse_high", optional_number(s.relmse_high)}};
}

nlohmann::json job_to_json(const JobStatus& s) {
  const RenderCounters& c = s.counters;
  nlohmann::json after = nlohmann::json::array();
  for (const JobId& id : s.after) after.push_back(id.value);
  const std::optional<bool> met = target_met(s);
  nlohmann::json job = {
      {"id", s.id.value},
      {"name", s.name},
      {"state", job_state_name(s.state)},
      {"message", s.message},
      {"missing_light", s.missing_light},
      {"scene", s.bundle_digest},
      {"settings", nlohmann::json::parse(settings_to_json(s.settings))},
      {"priority", s.priority},
      {"pool", s.pool},
      {"submitter", s.submitter},
      {"max_workers", s.max_workers == 0 ? nlohmann::json(nullptr) : nlohmann::json(s.max_workers)},
      {"deadline", s.deadline > 0 ? nlohmann::json(s.deadline) : nlohmann::json(nullptr)},
      {"after", std::move(after)},
      {"packets_done", s.packets_done},
      {"packets_total", s.packets_total},
      {"tiles_committed", s.tiles_committed},
      {"tiles_leased", s.tiles_leased},
      {"leases_reassigned", s.leases_reassigned},
      {"commit_bytes", s.commit_bytes},
      {"spp", s.spp},
      {"wall_seconds", s.wall_seconds},
      {"cpu_seconds", s.cpu_seconds},
      {"samples_per_second", s.samples_per_second},
      {"eta_seconds", s.eta_seconds < 0 ? nlohmann::json(nullptr) : nlohmann::json(s.eta_seconds)},
      {"waiting", s.waiting},
      {"waits_behind",
       s.waits_behind.empty() ? nlohmann::json(nullptr) : nlohmann::json(s.waits_behind.value)},
      {"turn_seconds", s.turn_seconds < 0 ? nlohmann::json(nullptr) : nlohmann::json(s.turn_seconds)},
      {"relmse", optional_number(s.relmse)},
      {"relmse_low", optional_number(s.relmse_low)},
      {"relmse_high", optional_number(s.relmse_high)},
      {"denoised_relmse", optional_number(s.denoised_relmse)},
      {"denoised_relmse_low", optional_number(s.denoised_relmse_low)},
      {"denoised_relmse_high", optional_number(s.denoised_relmse_high)},
      {"target_met", met ? nlohmann::json(*met) : nlohmann::json(nullptr)},
      {"nonfinite", c.nonfinite},
      {"dropped", dropped_to_json(s.dropped)},
      {"workers", s.workers},
      {"counters",
       {{"camera_paths", c.camera_paths},
        {"light_paths", c.light_paths},
        {"closest_hit_rays", c.closest_hit_rays},
        {"shadow_rays", c.shadow_rays},
        {"zero_connections_skipped", c.zero_connections_skipped},
        {"rouletted_connections", c.rouletted_connections},
        {"nonfinite", c.nonfinite}}}};
  for (const BoxFigure& figure : box_estimates()) job[figure.name] = optional_number(figure.of(s.boxes));
  return job;
}

nlohmann::json pilot_document(const std::optional<PilotReport>& pilot) {
  return pilot ? nlohmann::json::parse(pilot_to_json(*pilot)) : nlohmann::json(nullptr);
}

nlohmann::json tile_to_json(const TileStatus& t) {
  return {{"id", t.id.value},
          {"state", t.state},
          {"pilot", is_pilot(t.tile)},
          {"cells", {t.tile.cells.x0, t.tile.cells.y0, t.tile.cells.x1, t.tile.cells.y1}},
          {"sample_begin", t.tile.sample_begin},
          {"sample_end", t.tile.sample_end},
          {"attempt", t.attempt},
          {"worker", t.worker.value},
          {"digest", t.digest}};
}

nlohmann::json worker_to_json(const WorkerStatus& w) {
  return {{"id", w.id.value},
          {"state", w.state},
          {"host", w.registration.host},
          {"threads", w.registration.threads},
          {"pool", w.registration.pool},
          {"build", w.registration.build},
          {"arithmetic_class", w.registration.arithmetic_class},
          {"tiles_committed", w.tiles_committed},
          {"partials_refused", w.partials_refused},
          {"samples_per_second", w.samples_per_second},
          {"seconds_since_seen", w.seconds_since_seen}};
}

std::string dump(nlohmann::json document) {
  add_older_keys(&document);
  return document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace lightmill::client
