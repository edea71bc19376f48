#include "common/rpc/convert.h"

#include <algorithm>
#include <cmath>

#include "common/base/digest.h"
#include "common/base/utf8.h"
#include "common/farm/pilot_result.h"
#include "common/rpc/status.h"

namespace lightmill {
namespace {

[[noreturn]] void bad(const std::string& what) {
  throw Error(ErrorKind::kUsage, "malformed message: " + what);
}

template <class From, class To>
struct Pair {
  From domain;
  To wire;
};

constexpr Pair<JobState, v1::JobState> kJobStates[] = {
    {JobState::kQueued, v1::JOB_STATE_QUEUED}, {JobState::kRunning, v1::JOB_STATE_RUNNING},
    {JobState::kPaused, v1::JOB_STATE_PAUSED}, {JobState::kDone, v1::JOB_STATE_DONE},
    {JobState::kFailed, v1::JOB_STATE_FAILED}, {JobState::kCancelled, v1::JOB_STATE_CANCELLED},
};
constexpr Pair<CommitResult, v1::CommitOutcome> kOutcomes[] = {
    {CommitResult::kAccepted, v1::COMMIT_OUTCOME_ACCEPTED},
    {CommitResult::kAlreadyCommitted, v1::COMMIT_OUTCOME_ALREADY_COMMITTED},
    {CommitResult::kStale, v1::COMMIT_OUTCOME_STALE},
    {CommitResult::kCorrupt, v1::COMMIT_OUTCOME_CORRUPT},
    {CommitResult::kUnknownJob, v1::COMMIT_OUTCOME_UNKNOWN_JOB},
};
constexpr Pair<const char*, v1::TileState> kTileStates[] = {
    {"pending", v1::TILE_STATE_PENDING},
    {"leased", v1::TILE_STATE_LEASED},
    {"committed", v1::TILE_STATE_COMMITTED},
};
constexpr Pair<const char*, v1::WorkerState> kWorkerStates[] = {
    {"idle", v1::WORKER_STATE_IDLE},         {"rendering", v1::WORKER_STATE_RENDERING},
    {"draining", v1::WORKER_STATE_DRAINING}, {"lost", v1::WORKER_STATE_LOST},
    {"refused", v1::WORKER_STATE_REFUSED},   {"benched", v1::WORKER_STATE_BENCHED},
};

template <class Table, class Domain>
auto wire_of(const Table& table, const Domain& value, const char* what) {
  for (const auto& row : table) {
    if (value == row.domain) return row.wire;
  }
  throw std::logic_error(std::string("no message value for this ") + what);
}
template <class Table, class Wire>
auto domain_of(const Table& table, Wire value, const char* what) {
  for (const auto& row : table) {
    if (row.wire == value) return row.domain;
  }
  bad(std::string(what) + " " + std::to_string(static_cast<int>(value)) + " is unknown; is the peer newer?");
}

v1::RenderCounters counters_to_proto(const RenderCounters& c) {
  v1::RenderCounters m;
  m.set_camera_paths(c.camera_paths);
  m.set_light_paths(c.light_paths);
  m.set_closest_hit_rays(c.closest_hit_rays);
  m.set_shadow_rays(c.shadow_rays);
  m.set_zero_connections_skipped(c.zero_connections_skipped);
  m.set_rouletted_connections(c.rouletted_connections);
  m.set_nonfinite(c.nonfinite);
  return m;
}
RenderCounters counters_from_proto(const v1::RenderCounters& m) {
  RenderCounters c;
  c.camera_paths = m.camera_paths();
  c.light_paths = m.light_paths();
  c.closest_hit_rays = m.closest_hit_rays();
  c.shadow_rays = m.shadow_rays();
  c.zero_connections_skipped = m.zero_connections_skipped();
  c.rouletted_connections = m.rouletted_connections();
  c.nonfinite = m.nonfinite();
  return c;
}

constexpr Pair<DropKind, v1::DropKind> kDropKindNames[] = {
    {DropKind::kNotFinite, v1::DROP_KIND_NOT_FINITE},    {DropKind::kNegative, v1::DROP_KIND_NEGATIVE},
    {DropKind::kOutOfRange, v1::DROP_KIND_OUT_OF_RANGE}, {DropKind::kCapped, v1::DROP_KIND_CAPPED},
    {DropKind::kBelowRange, v1::DROP_KIND_BELOW_RANGE},
};

void set_if(const std::optional<double>& value, auto&& setter) {
  if (value) setter(*value);
}
std::optional<double> get_if(bool has, double value) { return has ? std::optional(value) : std::nullopt; }

using RepeatedBoxes = google::protobuf::RepeatedPtrField<v1::BoxError>;

void boxes_to_proto(const BoxErrors& boxes, RepeatedBoxes* messages) {
  for (size_t i = 0; i < boxes.size(); ++i) {
    const BoxError& box = boxes[i];
    if (box == BoxError{}) continue;
    v1::BoxError& m = *messages->Add();
    m.set_side(kBoxSides[i]);
    set_if(box.relmse, [&](double v) { m.set_relmse(v); });
    set_if(box.relmse_low, [&](double v) { m.set_relmse_low(v); });
    set_if(box.relmse_high, [&](double v) { m.set_relmse_high(v); });
    set_if(box.true_relmse, [&](double v) { m.set_true_relmse(v); });
  }
}
/// Sides that are unknown here are left out: a newer peer may have more. Of several of one side the last
/// counts.
BoxErrors boxes_from_proto(const RepeatedBoxes& messages) {
  BoxErrors boxes;
  for (const v1::BoxError& m : messages) {
    const auto side = std::find(kBoxSides.begin(), kBoxSides.end(), m.side());
    if (side == kBoxSides.end()) continue;
    boxes[static_cast<size_t>(side - kBoxSides.begin())] = {
        get_if(m.has_relmse(), m.relmse()), get_if(m.has_relmse_low(), m.relmse_low()),
        get_if(m.has_relmse_high(), m.relmse_high()), get_if(m.has_true_relmse(), m.true_relmse())};
  }
  return boxes;
}

using RepeatedDropped = google::protobuf::RepeatedPtrField<v1::DroppedContributions>;

void dropped_to_proto(const DroppedShares& dropped, RepeatedDropped* messages) {
  for (const auto& [kind, wire] : kDropKindNames) {
    const DroppedShare& share = dropped[static_cast<size_t>(kind)];
    if (share.count == 0) continue;
    v1::DroppedContributions& m = *messages->Add();
    m.set_kind(wire);
    m.set_count(share.count);
    set_if(share.share, [&](double v) { m.set_share(v); });
  }
}
/// A newer peer may have more kinds.
DroppedShares dropped_from_proto(const RepeatedDropped& messages) {
  DroppedShares dropped;
  for (const v1::DroppedContributions& m : messages) {
    for (const auto& [kind, wire] : kDropKindNames) {
      if (m.kind() == wire)
        dropped[static_cast<size_t>(kind)] = {m.count(), get_if(m.has_share(), m.share())};
    }
  }
  return dropped;
}

}  // namespace

v1::JobState to_proto(JobState state) { return wire_of(kJobStates, state, "job state"); }
JobState from_proto(v1::JobState state) { return domain_of(kJobStates, state, "job state"); }
v1::CommitOutcome to_proto(CommitResult result) { return wire_of(kOutcomes, result, "commit result"); }
CommitResult from_proto(v1::CommitOutcome outcome) { return domain_of(kOutcomes, outcome, "commit outcome"); }

v1::JobStatus to_proto(const JobStatus& s) {
  v1::JobStatus m;
  m.set_id(s.id.value);
  m.set_name(valid_utf8(s.name));
  m.set_state(to_proto(s.state));
  m.set_message(s.message);
  m.set_settings_json(settings_to_json(s.settings));
  m.set_bundle_digest(s.bundle_digest);
  m.set_priority(s.priority);
  m.set_pool(valid_utf8(s.pool));
  m.set_submitter(valid_utf8(s.submitter));
  m.set_max_workers(s.max_workers);
  m.set_deadline(s.deadline);
  for (const JobId& id : s.after) m.add_after(id.value);
  m.set_packets_done(s.packets_done);
  m.set_packets_total(s.packets_total);
  m.set_tiles_committed(s.tiles_committed);
  m.set_tiles_leased(s.tiles_leased);
  m.set_leases_reassigned(s.leases_reassigned);
  m.set_commit_bytes(s.commit_bytes);
  m.set_spp(s.spp);
  m.set_wall_seconds(s.wall_seconds);
  m.set_cpu_seconds(s.cpu_seconds);
  m.set_samples_per_second(s.samples_per_second);
  m.set_eta_seconds(s.eta_seconds);
  m.set_waiting(valid_utf8(s.waiting));
  m.set_waits_behind(s.waits_behind.value);
  if (s.turn_seconds >= 0) m.set_turn_seconds(s.turn_seconds);
  set_if(s.relmse, [&](double v) { m.set_relmse(v); });
  set_if(s.relmse_low, [&](double v) { m.set_relmse_low(v); });
  set_if(s.relmse_high, [&](double v) { m.set_relmse_high(v); });
  boxes_to_proto(s.boxes, m.mutable_boxes());
  set_if(s.denoised_relmse, [&](double v) { m.set_denoised_relmse(v); });
  set_if(s.denoised_relmse_low, [&](double v) { m.set_denoised_relmse_low(v); });
  set_if(s.denoised_relmse_high, [&](double v) { m.set_denoised_relmse_high(v); });
  *m.mutable_counters() = counters_to_proto(s.counters);
  dropped_to_proto(s.dropped, m.mutable_dropped());
  for (const std::string& line : s.missing_light) m.add_missing_light(valid_utf8(line));
  m.set_workers(s.workers);
  m.set_version(s.version);
  return m;
}

JobStatus from_proto(const v1::JobStatus& m) {
  JobStatus s;
  s.id = JobId{m.id()};
  s.name = m.name();
  s.state = from_proto(m.state());
  s.message = m.message();
  s.settings = settings_from_json(m.settings_json());
  s.bundle_digest = m.bundle_digest();
  s.priority = m.priority();
  s.pool = m.pool();
  s.submitter = m.submitter();
  s.max_workers = m.max_workers();
  s.deadline = m.deadline();
  for (const std::string& id : m.after()) s.after.push_back(JobId{id});
  s.packets_done = m.packets_done();
  s.packets_total = m.packets_total();
  s.tiles_committed = m.tiles_committed();
  s.tiles_leased = m.tiles_leased();
  s.leases_reassigned = m.leases_reassigned();
  s.commit_bytes = m.commit_bytes();
  s.spp = m.spp();
  s.wall_seconds = m.wall_seconds();
  s.cpu_seconds = m.cpu_seconds();
  s.samples_per_second = m.samples_per_second();
  s.eta_seconds = m.eta_seconds();
  s.waiting = m.waiting();
  s.waits_behind = JobId{m.waits_behind()};
  s.turn_seconds = m.has_turn_seconds() ? m.turn_seconds() : -1;
  s.relmse = get_if(m.has_relmse(), m.relmse());
  s.relmse_low = get_if(m.has_relmse_low(), m.relmse_low());
  s.relmse_high = get_if(m.has_relmse_high(), m.relmse_high());
  s.boxes = boxes_from_proto(m.boxes());
  s.denoised_relmse = get_if(m.has_denoised_relmse(), m.denoised_relmse());
  s.denoised_relmse_low = get_if(m.has_denoised_relmse_low(), m.denoised_relmse_low());
  s.denoised_relmse_high = get_if(m.has_denoised_relmse_high(), m.denoised_relmse_high());
  s.counters = counters_from_proto(m.counters());
  s.dropped = dropped_from_proto(m.dropped());
  s.missing_light.assign(m.missing_light().begin(), m.missing_light().end());
  s.workers = m.workers();
  s.version = m.version();
  return s;
}

v1::TileSpec to_proto(const TileSpec& tile) {
  v1::TileSpec m;
  m.mutable_cells()->set_x0(tile.cells.x0);
  m.mutable_cells()->set_y0(tile.cells.y0);
  m.mutable_cells()->set_x1(tile.cells.x1);
  m.mutable_cells()->set_y1(tile.cells.y1);
  m.set_sample_begin(tile.sample_begin);
  m.set_sample_end(tile.sample_end);
  return m;
}

TileSpec from_proto(const v1::TileSpec& m) {
  constexpr int kMaxCells = kMaxResolution / kCellSize;
  const v1::CellRect& c = m.cells();
  if (c.x0() < 0 || c.y0() < 0 || c.x1() <= c.x0() || c.y1() <= c.y0() || c.x1() > kMaxCells ||
      c.y1() > kMaxCells) {
    bad("tile: cells out of range");
  }
  if (m.sample_begin() < 0 || m.sample_end() <= m.sample_begin() || m.sample_end() > (int64_t{1} << 40)) {
    bad("tile: sample range out of range");
  }
  return {{c.x0(), c.y0(), c.x1(), c.y1()}, m.sample_begin(), m.sample_end()};
}

v1::TileStatus to_proto(const TileStatus& s) {
  v1::TileStatus m;
  m.set_id(s.id.value);
  m.set_pilot(is_pilot(s.tile));
  if (!m.pilot()) *m.mutable_tile() = to_proto(s.tile);
  m.set_state(wire_of(kTileStates, s.state, "tile state"));
  m.set_attempt(s.attempt);
  m.set_worker_id(s.worker.value);
  m.set_digest(s.digest);
  return m;
}

TileStatus from_proto(const v1::TileStatus& m) {
  return {TileId{m.id()},
          m.pilot() ? TileSpec{} : from_proto(m.tile()),
          domain_of(kTileStates, m.state(), "tile state"),
          m.attempt(),
          WorkerId{m.worker_id()},
          m.digest()};
}

v1::WorkerRegistration to_proto(const WorkerRegistration& r) {
  v1::WorkerRegistration m;
  m.set_host(one_line(r.host));
  m.set_threads(r.threads);
  m.set_build(r.build);
  m.set_schema(r.schema);
  m.set_arithmetic_class(r.arithmetic_class);
  m.set_pool(one_line(r.pool));
  m.set_memory_bytes(r.memory_bytes);
  return m;
}

WorkerRegistration from_proto(const v1::WorkerRegistration& m) {
  if (m.threads() < 1 || m.threads() > 4096) bad("threads must be 1..4096");
  for (const std::string* text : {&m.host(), &m.build(), &m.arithmetic_class(), &m.pool()}) {
    if (text->size() > 1000) bad("a text of a registration is longer than 1000 bytes");
  }
  return {
      one_line(m.host()), m.threads(),     one_line(m.build()), m.schema(), one_line(m.arithmetic_class()),
      one_line(m.pool()), m.memory_bytes()};
}

v1::WorkerStatus to_proto(const WorkerStatus& s) {
  v1::WorkerStatus m;
  m.set_id(s.id.value);
  *m.mutable_registration() = to_proto(s.registration);
  m.set_state(wire_of(kWorkerStates, s.state, "worker state"));
  m.set_tiles_committed(s.tiles_committed);
  m.set_samples_per_second(s.samples_per_second);
  m.set_seconds_since_seen(s.seconds_since_seen);
  m.set_partials_refused(s.partials_refused);
  return m;
}

WorkerStatus from_proto(const v1::WorkerStatus& m) {
  return {
      WorkerId{m.id()},    from_proto(m.registration()), domain_of(kWorkerStates, m.state(), "worker state"),
      m.tiles_committed(), m.samples_per_second(),       m.seconds_since_seen(),
      m.partials_refused()};
}

v1::FailureKind to_proto(FailureKind kind) {
  switch (kind) {
    case FailureKind::kTile:
      return v1::FAILURE_KIND_TILE;
    case FailureKind::kScene:
      return v1::FAILURE_KIND_SCENE;
    case FailureKind::kMemory:
      return v1::FAILURE_KIND_MEMORY;
  }
  return v1::FAILURE_KIND_UNSPECIFIED;
}

FailureKind from_proto(v1::FailureKind kind) {
  if (kind == v1::FAILURE_KIND_SCENE) return FailureKind::kScene;
  return kind == v1::FAILURE_KIND_MEMORY ? FailureKind::kMemory : FailureKind::kTile;
}

v1::LeaseKey to_proto(const LeaseKey& key) {
  v1::LeaseKey m;
  m.set_job_id(key.job.value);
  m.set_tile_id(key.tile.value);
  m.set_attempt(key.attempt);
  return m;
}

LeaseKey from_proto(const v1::LeaseKey& m) {
  if (m.job_id().empty() || m.job_id().size() > 100 || m.tile_id() < 0 || m.attempt() < 1) bad("lease key");
  return {JobId{m.job_id()}, TileId{m.tile_id()}, m.attempt()};
}

std::string grant_digest(v1::LeaseGrant grant) {
  grant.clear_digest();
  return sha256_hex(grant.SerializeAsString());
}

v1::LeaseGrant to_proto(const LeaseGrant& g) {
  v1::LeaseGrant m;
  *m.mutable_key() = to_proto(LeaseKey{g.job, g.tile_id, g.attempt});
  m.set_pilot(is_pilot(g.tile));
  if (!m.pilot()) *m.mutable_tile() = to_proto(g.tile);
  m.set_settings_json(settings_to_json(g.settings));
  m.set_bundle_digest(g.bundle_digest);
  m.set_lease_seconds(g.lease_seconds);
  m.set_digest(grant_digest(m));
  return m;
}

LeaseGrant from_proto(const v1::LeaseGrant& m) {
  const LeaseKey key = from_proto(m.key());
  if (!(m.lease_seconds() > 0 && m.lease_seconds() <= 86400)) bad("lease_seconds");
  return {key.job,
          key.tile,
          key.attempt,
          m.pilot() ? TileSpec{} : from_proto(m.tile()),
          settings_from_json(m.settings_json()),
          m.bundle_digest(),
          m.lease_seconds()};
}

v1::ErrorCurve to_proto(const ErrorCurve& curve) {
  v1::ErrorCurve m;
  m.set_job_name(curve.job_name);
  for (const ErrorPoint& p : curve.points) {
    v1::ErrorPoint& q = *m.add_points();
    q.set_wall_seconds(p.wall_seconds);
    q.set_cpu_seconds(p.cpu_seconds);
    q.set_spp(p.spp);
    set_if(p.relmse, [&](double v) { q.set_relmse(v); });
    set_if(p.relmse_low, [&](double v) { q.set_relmse_low(v); });
    set_if(p.relmse_high, [&](double v) { q.set_relmse_high(v); });
    q.set_batches(p.batches);
    set_if(p.true_relmse, [&](double v) { q.set_true_relmse(v); });
    set_if(p.true_relmse_trimmed, [&](double v) { q.set_true_relmse_trimmed(v); });
    set_if(p.true_flip, [&](double v) { q.set_true_flip(v); });
    boxes_to_proto(p.boxes, q.mutable_boxes());
    set_if(p.denoised_relmse, [&](double v) { q.set_denoised_relmse(v); });
    set_if(p.denoised_relmse_low, [&](double v) { q.set_denoised_relmse_low(v); });
    set_if(p.denoised_relmse_high, [&](double v) { q.set_denoised_relmse_high(v); });
  }
  return m;
}

ErrorCurve from_proto(const v1::ErrorCurve& m) {
  ErrorCurve curve;
  curve.job_name = m.job_name();
  for (const v1::ErrorPoint& q : m.points()) {
    ErrorPoint p;
    p.wall_seconds = q.wall_seconds();
    p.cpu_seconds = q.cpu_seconds();
    p.spp = q.spp();
    p.relmse = get_if(q.has_relmse(), q.relmse());
    p.relmse_low = get_if(q.has_relmse_low(), q.relmse_low());
    p.relmse_high = get_if(q.has_relmse_high(), q.relmse_high());
    p.batches = q.batches();
    p.true_relmse = get_if(q.has_true_relmse(), q.true_relmse());
    p.true_relmse_trimmed = get_if(q.has_true_relmse_trimmed(), q.true_relmse_trimmed());
    p.true_flip = get_if(q.has_true_flip(), q.true_flip());
    p.boxes = boxes_from_proto(q.boxes());
    p.denoised_relmse = get_if(q.has_denoised_relmse(), q.denoised_relmse());
    p.denoised_relmse_low = get_if(q.has_denoised_relmse_low(), q.denoised_relmse_low());
    p.denoised_relmse_high = get_if(q.has_denoised_relmse_high(), q.denoised_relmse_high());
    curve.points.push_back(p);
  }
  return curve;
}

}  // namespace lightmill
