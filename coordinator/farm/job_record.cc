#include "coordinator/farm/job_record.h"

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/base/json/json_text.h"

namespace lightmill {
namespace {

using nlohmann::json;

struct CounterField {
  const char* name;
  uint64_t RenderCounters::*member;
};
constexpr CounterField kCounters[] = {
    {"camera_paths", &RenderCounters::camera_paths},
    {"light_paths", &RenderCounters::light_paths},
    {"closest_hit_rays", &RenderCounters::closest_hit_rays},
    {"shadow_rays", &RenderCounters::shadow_rays},
    {"zero_connections_skipped", &RenderCounters::zero_connections_skipped},
    {"rouletted_connections", &RenderCounters::rouletted_connections},
    {"nonfinite", &RenderCounters::nonfinite},
};

/// {"capped": [count, amount], ...}, of the kinds that there are.
std::string dropped_to_json(const Dropped& dropped) {
  JsonText text;
  for (size_t i = 0; i < kDropKinds; ++i) {
    const Dropped::Kind& kind = dropped.kinds[i];
    if (kind.count == 0) continue;
    text.add_raw(drop_kind_name(static_cast<DropKind>(i)), json{kind.count, kind.amount}.dump());
  }
  return text.end();
}

Dropped dropped_from_json(const json& j) {
  Dropped dropped;
  for (size_t i = 0; i < kDropKinds; ++i) {
    const auto kind = j.find(drop_kind_name(static_cast<DropKind>(i)));
    if (kind != j.end()) dropped.kinds[i] = {kind->at(0).get<uint64_t>(), kind->at(1).get<double>()};
  }
  return dropped;
}

}  // namespace

const char* tile_state_name(TileState state) {
  switch (state) {
    case TileState::kPending:
      return "pending";
    case TileState::kLeased:
      return "leased";
    case TileState::kCommitted:
      return "committed";
  }
  throw std::logic_error("unknown tile state");
}

std::vector<LeaseToken> lease_tokens(const TileRecord& tile) {
  std::vector<LeaseToken> tokens = tile.others;
  if (tile.rival_attempt > 0) tokens.push_back({tile.rival_attempt, tile.rival_worker});
  if (!tile.worker.empty()) tokens.push_back({tile.attempt, tile.worker});
  return tokens;
}

bool committed_under(const TileRecord& tile, const LeaseToken& token) {
  return tile.state == TileState::kCommitted && lease_tokens(tile) == std::vector{token};
}

TileRecord voided(TileRecord tile) {
  tile.state = TileState::kPending;
  if (tile.worker.empty()) tile.worker = tile.rival_worker;
  tile.rival_attempt = 0;
  tile.rival_worker = {};
  tile.others.clear();
  return tile;
}

TileStatus tile_status(const TileRecord& tile) {
  const std::vector<LeaseToken> tokens = lease_tokens(tile);
  const bool counted = tile.state == TileState::kCommitted && !tokens.empty();
  return {tile.id,
          tile.tile,
          tile_state_name(tile.state),
          counted ? tokens[0].attempt : tile.attempt,
          tokens.empty() ? WorkerId{} : tokens.back().worker,
          tile.digest};
}

std::string tile_name(const LeaseKey& key, bool pilot) {
  return "job " + key.job.value + (pilot ? " pilot" : " tile " + std::to_string(key.tile.value));
}

std::string tile_text(const TileRecord& tile) {
  if (is_pilot(tile.tile)) return "the pilot";
  const CellRect& c = tile.tile.cells;
  return "tile " + std::to_string(tile.id.value) + " (cells " + std::to_string(c.x0) + "," +
         std::to_string(c.y0) + " to " + std::to_string(c.x1) + "," + std::to_string(c.y1) + ", samples " +
         std::to_string(tile.tile.sample_begin) + " to " + std::to_string(tile.tile.sample_end) + ")";
}

namespace {

json ends_to_json(const Ends& ends) { return json::array({ends.count, ends.told}); }

/// Those of a record of an older version, or without hooks, are none.
Ends ends_from_json(const json& record) {
  if (!record.contains("ends")) return {};
  return {record.at("ends").at(0).get<int>(), record.at("ends").at(1).get<int>()};
}

}  // namespace

std::string sequence_record_to_json(const SequenceRecord& record) {
  const SequenceRequest& r = record.request;
  json after = json::array();
  for (const JobId& id : r.after) after.push_back(id.value);
  json j = {{"name", r.name},
            {"priority", r.priority},
            {"pool", r.pool},
            {"submitter", r.submitter},
            {"max_workers", r.max_workers},
            {"deadline", r.deadline},
            {"after", after},
            {"order", frame_order_name(r.order)},
            {"fps", r.fps},
            {"budget_seconds", r.budget_seconds},
            {"most_spp", r.most_spp}};
  if (record.ends.count > 0) j["ends"] = ends_to_json(record.ends);
  return j.dump(-1, ' ', false, json::error_handler_t::replace);
}

SequenceRecord sequence_record_from_json(const SequenceId& id, const std::string& text) {
  try {
    const json j = json::parse(text);
    SequenceRecord record;
    record.id = id;
    SequenceRequest& r = record.request;
    r.name = j.at("name").get<std::string>();
    r.priority = j.at("priority").get<int>();
    r.pool = j.at("pool").get<std::string>();
    r.submitter = j.at("submitter").get<std::string>();
    r.max_workers = j.at("max_workers").get<int>();
    r.deadline = j.at("deadline").get<double>();
    for (const json& job : j.at("after")) r.after.push_back(JobId{job.get<std::string>()});
    const auto order = frame_order_from_name(j.at("order").get<std::string>());
    if (!order) throw Error(ErrorKind::kFailed, "unknown order of frames");
    r.order = *order;
    r.fps = j.at("fps").get<double>();
    r.budget_seconds = j.at("budget_seconds").get<double>();
    r.most_spp = j.at("most_spp").get<int64_t>();
    record.ends = ends_from_json(j);
    return record;
  } catch (const std::exception& e) {
    throw Error(ErrorKind::kFailed, "sequence " + id.value + " in the store: " + e.what());
  }
}

std::string job_record_to_json(const JobRecord& r) {
  JsonText counters, text;
  for (const CounterField& field : kCounters) counters.add(field.name, r.counters.*field.member);
  json after = json::array();
  for (const JobId& id : r.after) after.push_back(id.value);
  text.add_raw("after", after.dump(-1, ' ', false, json::error_handler_t::replace));
  text.add("bundle", r.bundle_digest);
  text.add("class", r.arithmetic_class);
  text.add("commit_bytes", r.commit_bytes);
  text.add_raw("counters", counters.end());
  text.add("cpu_seconds", r.cpu_seconds);
  if (r.deadline > 0) text.add("deadline", r.deadline);
  if (r.dropped.any()) text.add_raw("dropped", dropped_to_json(r.dropped));
  if (r.ends.count > 0) text.add_raw("ends", ends_to_json(r.ends).dump());
  if (r.image_mean) text.add("image_mean", *r.image_mean);
  text.add("leases_reassigned", r.leases_reassigned);
  text.add("max_workers", r.max_workers);
  text.add("message", r.message);
  if (!r.missing_light.empty())
    text.add_raw("missing_light", json(r.missing_light).dump(-1, ' ', false, json::error_handler_t::replace));
  text.add("name", r.name);
  text.add("packets_done", r.packets_done);
  text.add("pixel_samples", r.pixel_samples);
  text.add("pool", r.pool);
  text.add("priority", r.priority);
  if (r.quantum_exponent) text.add("quantum", *r.quantum_exponent);
  text.add("settings", settings_to_json(r.settings));
  text.add("state", job_state_name(r.state));
  text.add("submitter", r.submitter);
  text.add("target_met", r.target_met);
  text.add("tiles_committed", r.tiles_committed);
  text.add("wall_seconds", r.wall_seconds);
  return text.end();
}

JobRecord job_record_from_json(const JobId& id, const std::string& text) {
  try {
    const json j = json::parse(text);
    JobRecord r;
    r.id = id;
    r.frame = frame_of(id);
    r.name = j.at("name").get<std::string>();
    r.bundle_digest = j.at("bundle").get<std::string>();
    r.settings = settings_from_json(j.at("settings").get<std::string>());
    r.priority = j.at("priority").get<int>();
    r.pool = j.at("pool").get<std::string>();
    if (j.contains("submitter")) {  // since schema 4
      r.submitter = j.at("submitter").get<std::string>();
      r.max_workers = j.at("max_workers").get<int>();
      for (const json& id_text : j.at("after")) r.after.push_back(JobId{id_text.get<std::string>()});
    }
    r.deadline = j.value("deadline", 0.0);
    const auto state = job_state_from_name(j.at("state").get<std::string>());
    if (!state) throw Error(ErrorKind::kFailed, "job " + id.value + " in the store: unknown state");
    r.state = *state;
    r.ends = ends_from_json(j);
    r.message = j.at("message").get<std::string>();
    r.arithmetic_class = j.at("class").get<std::string>();
    if (j.contains("quantum")) r.quantum_exponent = j.at("quantum").get<int>();
    r.target_met = j.at("target_met").get<bool>();
    r.wall_seconds = j.at("wall_seconds").get<double>();
    r.cpu_seconds = j.at("cpu_seconds").get<double>();
    r.packets_done = j.at("packets_done").get<int64_t>();
    r.tiles_committed = j.at("tiles_committed").get<int64_t>();
    r.leases_reassigned = j.at("leases_reassigned").get<int64_t>();
    r.pixel_samples = j.at("pixel_samples").get<int64_t>();
    r.commit_bytes = j.value("commit_bytes", uint64_t{0});  // not counted by older versions
    if (j.contains("missing_light")) r.missing_light = j.at("missing_light").get<std::vector<std::string>>();
    for (const CounterField& field : kCounters) {
      r.counters.*field.member = j.at("counters").at(field.name).get<uint64_t>();
    }
    if (j.contains("dropped")) r.dropped = dropped_from_json(j.at("dropped"));
    if (j.contains("image_mean")) r.image_mean = j.at("image_mean").get<double>();
    return r;
  } catch (const json::exception& e) {
    throw Error(ErrorKind::kFailed, "job " + id.value + " in the store is malformed: " + e.what());
  }
}

}  // namespace lightmill
