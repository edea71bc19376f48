#include "coordinator/core/farm_impl.h"

#include <algorithm>

#include "common/base/log.h"
#include "coordinator/store/guarded_job_store.h"

namespace lightmill {
namespace {

/// Leases that end in silence are nobody's fault (a killed worker), up to a point.
constexpr int64_t kSilentAttemptsPerAllowed = 10;
/// A job whose tiles fail this many times the allowed attempts in a row, without one commit, is hopeless.
constexpr int kRowOfFailures = 3;

std::string tile_text(const TileRecord& tile) {
  if (is_pilot(tile.tile)) return "the pilot";
  const CellRect& c = tile.tile.cells;
  return "tile " + std::to_string(tile.id.value) + " (cells " + std::to_string(c.x0) + "," +
         std::to_string(c.y0) + " to " + std::to_string(c.x1) + "," + std::to_string(c.y1) + ", samples " +
         std::to_string(tile.tile.sample_begin) + " to " + std::to_string(tile.tile.sample_end) + ")";
}

}  // namespace

TileRecord voided(TileRecord tile) {
  tile.state = TileState::kPending;
  if (tile.worker.empty()) tile.worker = tile.rival_worker;
  tile.rival_attempt = 0;
  tile.rival_worker = {};
  return tile;
}

std::string tile_name(const LeaseKey& key, bool pilot) {
  return "job " + key.job.value + (pilot ? " pilot" : " tile " + std::to_string(key.tile.value));
}

std::string numbered(std::string prefix, int64_t number) { return prefix.append(std::to_string(number)); }

Farm::Impl::Impl(std::unique_ptr<JobStore> job_store, const Clock& the_clock, const FarmOptions& farm_options)
    : clock(the_clock),
      store(std::make_unique<GuardedJobStore>(std::move(job_store), health, the_clock)),
      options(farm_options),
      scheduler(
          {farm_options.target_tile_seconds, farm_options.film_memory_bytes,
           farm_options.ingest_bytes_per_second, farm_options.commits_per_second, farm_options.max_workers},
          farm_options.lease_seconds),
      merger(*store, farm_options.film_memory_bytes, farm_options.spot_check > 0) {
  for (const JobRecord& record : store->jobs()) {
    Job loaded;
    loaded.record = record;
    loaded.ledger_loaded = false;
    loaded.version = ++version;
    loaded.curve_loaded = false;
    Job& added = scheduler.add(std::move(loaded));
    if (is_final(record.state)) continue;
    load_curve(added);
    load_ledger(added);
  }
}

void Farm::Impl::log(const std::string& line) const {
  if (options.log) options.log(line);
}

Job& Farm::Impl::job(const JobId& id) {
  Job* found = scheduler.find(id);
  if (!found) throw UnknownJob(id);
  try {
    load_curve(*found);
  } catch (const StoreError&) {  // its status is shown without, and the next look tries again
  }
  return *found;
}

void Farm::Impl::load_curve(Job& job) {
  if (job.curve_loaded) return;
  for (const ErrorPoint& point : store->curve(job.record.id)) {
    job.last_point = point;
    if (point.relmse) job.last_estimate = point;
  }
  job.curve_loaded = true;
}

void Farm::Impl::load_ledger(Job& job) {
  if (job.ledger_loaded) return;
  std::vector<TileRecord> tiles = store->tiles(job.record.id);
  // Leases from before are void; their attempt numbers stay used.
  for (TileRecord& tile : tiles) {
    if (tile.state == TileState::kLeased) tile = voided(tile);
  }
  job.tiles = LeaseTable();
  job.tiles.add(tiles);
  for (const TileRecord& tile : tiles) {
    if (tile.state == TileState::kCommitted && tile.check == TileCheck::kWanted) job.checks.add(tile);
  }
  job.ledger_loaded = true;
  if (options.spot_check == 0) job.tiles.forget(kTilesInMemory);
}

std::vector<TileRecord> Farm::Impl::ledger(const Job& job) const {
  if (job.ledger_loaded && job.tiles.forgotten() == 0)
    return {job.tiles.tiles().begin(), job.tiles.tiles().end()};
  std::vector<TileRecord> tiles = store->tiles(job.record.id);
  for (TileRecord& tile : tiles) {
    if (!job.ledger_loaded && tile.state == TileState::kLeased) tile = voided(tile);
  }
  return tiles;
}

JobRecord Farm::Impl::record_at(const Job& job, double now) const {
  JobRecord record = job.record;
  record.wall_seconds = Scheduler::wall_seconds(job, now);
  return record;
}

void Farm::Impl::update(Job& job, JobRecord record, double now) {
  store->save_job(record);
  job.record = std::move(record);
  if (job.running_since >= 0) job.running_since = now;
  scheduler.state_changed(job);
  touch(job);
}

void Farm::Impl::touch_quietly(Job& job) {
  job.version = ++version;
  changed.notify_all();
}

void Farm::Impl::touch(Job& job) {
  touch_quietly(job);
  work.notify_all();
}

void Farm::Impl::end(Job& job, JobState state, const std::string& message, double now) {
  JobRecord record = record_at(job, now);
  record.state = state;
  record.message = message;
  store->save_job(record);
  for (const LeaseTable::Lease& lease : job.tiles.leases()) {
    if (Worker* worker = scheduler.workers.find(lease.worker)) --worker->leases;
  }
  for (const LeaseTable::Lease& lease : job.checks.leases()) {
    if (Worker* worker = scheduler.workers.find(lease.worker)) --worker->leases;
  }
  job.checks = CheckTable();
  job.record = std::move(record);
  job.running_since = -1;
  job.tiles = LeaseTable();  // from now on the store has it; tiles that it calls leased are void
  job.ledger_loaded = false;
  job.failed_on.clear();
  job.recent.clear();
  scheduler.state_changed(job);
  touch(job);
}

void Farm::Impl::release(Job& job, const LeaseTable::Lease& lease, bool failed, const std::string& reason,
                         double now) {
  const TileRecord record = job.tiles.released(lease.tile, lease.attempt, failed);
  store->save_tile(record_at(job, now), record);
  job.tiles.apply(record);
  scheduler.settled(job, lease.tile, lease.attempt, 0);
  if (Worker* worker = scheduler.workers.find(lease.worker)) --worker->leases;
  if (failed) {
    job.failed_on.insert({lease.tile, lease.worker});
    ++job.failures_in_row;
  }
  touch(job);
  const bool hopeless = failed && (record.failures >= options.max_attempts ||
                                   job.failures_in_row >= kRowOfFailures * options.max_attempts);
  if (hopeless) {
    end(job, JobState::kFailed,
        tile_text(record) + " failed " +
            (record.failures > 1 ? std::to_string(record.failures) + " times, last " : std::string()) +
            "on worker " + lease.worker.value + ": " + reason,
        now);
  } else if (!failed && record.attempt >= kSilentAttemptsPerAllowed * options.max_attempts) {
    end(job, JobState::kFailed,
        tile_text(record) + " was leased " + std::to_string(record.attempt) +
            " times and its workers never came back, last " + lease.worker.value,
        now);
  }
}

void Farm::Impl::release(const WorkerId& worker, const LeaseKey& key, bool failed, const std::string& reason,
                         double now) {
  Job* owner = scheduler.find(key.job);
  if (owner && owner->checks.holds(key.tile, worker, key.attempt)) {
    release_check(*owner, {key.tile, key.attempt, worker});
    return;
  }
  if (!owner || !owner->tiles.holds(key.tile, worker, key.attempt)) return;
  release(*owner, {key.tile, key.attempt, worker}, failed, reason, now);
}

void Farm::Impl::apply_commit(Job& job, JobRecord record, const TileRecord& tile, const LeaseKey& lease,
                              double cpu_seconds, double now) {
  for (const LeaseTable::Lease& ended : job.tiles.leases_of(tile.id)) {
    if (Worker* worker = scheduler.workers.find(ended.worker)) --worker->leases;
    scheduler.settled(job, tile.id, ended.attempt, ended.attempt == lease.attempt ? cpu_seconds : 0);
  }
  job.record = std::move(record);
  if (job.running_since >= 0) job.running_since = now;
  job.tiles.apply(tile);
  if (options.spot_check == 0) job.tiles.forget(kTilesInMemory);
  job.failures_in_row = 0;
  ++stats.commits;
}

void Farm::Impl::release_expired(double now) {
  if (health.fault()) return;  // nothing can be recorded; workers that live keep renewing
  for (Job* active : scheduler.active_jobs()) {
    for (const LeaseTable::Lease& lease : active->tiles.expired(now)) {
      if (is_final(active->record.state)) break;
      ++stats.leases_expired;
      const LeaseKey key{active->record.id, lease.tile, lease.attempt};
      const LogScope scope({key.job.value, key.tile.value, key.attempt, lease.worker.value});
      log("lease of " + tile_name(key, is_pilot(active->tiles.find(lease.tile)->tile)) + " by " +
          lease.worker.value + " expired");
      release(*active, lease, false, "", now);
    }
    for (const LeaseTable::Lease& lease : active->checks.expired(now)) {
      ++stats.leases_expired;
      release_check(*active, lease);
    }
  }
}

std::vector<JobId> Farm::Impl::complete_jobs(double now) const {
  std::vector<JobId> ids;
  if (health.fault()) return ids;
  for (const JobId& id : scheduler.active()) {
    const Job& job = *scheduler.find(id);
    if (job.fault.empty() && scheduler.complete(job, now)) ids.push_back(id);
  }
  return ids;
}

JobStatus Farm::Impl::status(const Job& job, double now) const {
  const JobRecord& r = job.record;
  JobStatus s;
  s.id = r.id;
  s.name = r.name;
  s.state = r.state;
  s.message = r.message.empty() ? scheduler.note(job, now) : r.message;
  if (const std::optional<std::string> fault = job.fault.empty() ? health.fault() : job.fault;
      fault && (r.state == JobState::kQueued || r.state == JobState::kRunning)) {
    s.state = JobState::kPaused;
    s.message = *fault + "; the job goes on by itself once that is mended";
  }
  s.settings = r.settings;
  s.bundle_digest = r.bundle_digest;
  s.priority = r.priority;
  s.pool = r.pool;
  s.submitter = r.submitter;
  s.max_workers = r.max_workers;
  s.after = r.after;
  s.packets_done = r.packets_done;
  // A job that stopped before its spp (time, target) is complete with what it has.
  s.packets_total = r.state == JobState::kDone
                        ? r.packets_done
                        : r.settings.grid.cells().count() * block_count(r.settings.spp);
  s.tiles_committed = r.tiles_committed;
  s.tiles_leased = job.tiles.leased_count();
  s.tiles_pending = job.tiles.pending_count();
  s.leases_reassigned = r.leases_reassigned;
  s.commit_bytes = r.commit_bytes;
  s.spp = static_cast<double>(r.pixel_samples) / static_cast<double>(r.settings.grid.crop.area());
  s.wall_seconds = Scheduler::wall_seconds(job, now);
  s.cpu_seconds = r.cpu_seconds;
  s.samples_per_second = Scheduler::recent_rate(job, now);
  s.eta_seconds = Scheduler::eta_seconds(job, now);
  if (job.last_estimate) {
    s.relmse = job.last_estimate->relmse;
    s.relmse_low = job.last_estimate->relmse_low;
    s.relmse_high = job.last_estimate->relmse_high;
  }
  s.counters = r.counters;
  s.missing_light = r.missing_light;
  s.workers = job.tiles.workers();
  s.version = job.version;
  return s;
}

}  // namespace lightmill
