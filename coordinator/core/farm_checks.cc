// Spot checks: one in so many committed tiles is rendered once more by another worker.
//
// A tile is folded when it is committed, checked or not: holding it back would hold back the picture, and
// would not help, since a worker that is caught has handed in other tiles before that nobody looked at.
// Instead the partials of a job stay in the store until its end, also those that a snapshot contains, so that
// all that a liar handed in can be taken out of the film, which is folded anew from the rest. A job ends
// after its checks.
#include <set>

#include "coordinator/core/farm_impl.h"

namespace lightmill {
namespace {

constexpr double kCheckPatience = 3;  // lease times without a second worker

RenderCounters difference(const RenderCounters& a, const RenderCounters& b) {
  return {a.camera_paths - b.camera_paths,
          a.light_paths - b.light_paths,
          a.closest_hit_rays - b.closest_hit_rays,
          a.shadow_rays - b.shadow_rays,
          a.zero_connections_skipped - b.zero_connections_skipped,
          a.rouletted_connections - b.rouletted_connections,
          a.nonfinite - b.nonfinite};
}

}  // namespace

bool Farm::Impl::draw_check(const WorkerId& worker) {
  if (options.spot_check <= 0) return false;
  const Worker* known = scheduler.workers.find(worker);
  if (known && known->convicted) return true;
  return std::uniform_int_distribution<int>(1, options.spot_check)(random) == 1;
}

LeaseGrant Farm::Impl::lease_check(Job& job, TileId tile, const WorkerId& worker, double now) {
  const int64_t attempt = job.checks.lease(tile, worker, now + options.lease_seconds);
  TileRecord row = *job.tiles.find(tile);
  row.attempt = attempt;
  row.worker = worker;
  scheduler.granted(job, row);
  ++scheduler.workers.find(worker)->leases;
  ++stats.leases;
  touch_quietly(job);
  return {job.record.id,        tile, attempt, row.tile, job.record.settings, job.record.bundle_digest,
          options.lease_seconds};
}

void Farm::Impl::end_check(Job& job, const LeaseTable::Lease& lease, double cpu_seconds) {
  if (Worker* worker = scheduler.workers.find(lease.worker)) --worker->leases;
  scheduler.settled(job, lease.tile, lease.attempt, cpu_seconds);
}

void Farm::Impl::release_check(Job& job, const LeaseTable::Lease& lease) {
  end_check(job, lease, 0);
  job.checks.release(lease.tile);
  touch(job);
}

CommitResult Farm::Impl::commit_check(const WorkerId& worker, const LeaseKey& lease, const Partial& partial,
                                      const std::string& digest, const std::string& bytes) {
  std::string difference_text;
  {
    const std::lock_guard lock(mutex);
    Job* owner = scheduler.find(lease.job);
    if (!owner || !owner->checks.holds(lease.tile, worker, lease.attempt)) {
      ++stats.commits_stale;
      return CommitResult::kStale;
    }
    const double now = clock.now();
    const CheckTable::Outcome outcome = owner->checks.vote(lease.tile, digest);
    end_check(*owner, {lease.tile, lease.attempt, worker}, partial.cpu_seconds);
    ++stats.checks;
    const std::vector<CheckTable::Vote> votes = owner->checks.votes(lease.tile);
    const std::string what = tile_name(lease, false);
    if (outcome.hopeless) {
      end(*owner, JobState::kFailed,
          "tile " + std::to_string(lease.tile.value) + " came out differently on workers " +
              votes[0].worker.value + ", " + votes[1].worker.value + " and " + votes[2].worker.value +
              ": the image can't be trusted; check those machines, then submit the job again",
          now);
    } else if (outcome.decided && outcome.first_is_right) {
      TileRecord row = *owner->tiles.find(lease.tile);
      row.check = TileCheck::kPassed;
      store->save_tile(record_at(*owner, now), row);
      owner->tiles.apply(row);
      owner->checks.remove(lease.tile);
    }
    if (!outcome.decided || outcome.liar) {
      difference_text = what + ": " + worker.value + " rendered " + digest.substr(0, 12) + ", " +
                        votes[0].worker.value + " committed " + votes[0].digest.substr(0, 12);
      log("spot check of " + difference_text);
    }
    if (outcome.liar) convict(*outcome.liar, what, now);
    if (const Worker* taker = scheduler.workers.find(worker); taker && outcome.liar != worker) {
      const TileSpec& tile = partial.tile;
      const auto samples = partial.grid.pixels(tile.cells).area() * tile.samples();
      const double seconds = partial.cpu_seconds / std::max(1, taker->registration.threads);
      scheduler.workers.committed(worker, static_cast<double>(samples), seconds, now - seconds, now);
    }
    touch(*owner);
  }
  if (!difference_text.empty()) {
    keep_evidence(lease, worker, "spot check of " + difference_text, bytes);
    keep_evidence(lease, worker, "spot check of " + difference_text + "; this is what was committed",
                  store->partial(lease.job, lease.tile));
  }
  take_back_lies();
  settle_complete();
  return CommitResult::kAccepted;
}

void Farm::Impl::keep_evidence(const LeaseKey& lease, const WorkerId& worker, const std::string& reason,
                               const std::string& bytes) const {
  try {
    if (options.quarantine) options.quarantine(lease, worker, reason, bytes);
  } catch (const Error& e) {  // evidence is good to have, no more
    log(e.what());
  }
}

void Farm::Impl::convict(const WorkerId& liar, const std::string& what, double now) {
  ++stats.liars;
  scheduler.workers.convict(liar, now);
  log("worker " + liar.value + " rendered " + what + " wrongly: benched, and its tiles are rendered again");
  for (const JobId& id : scheduler.order()) {
    Job& other = job(id);
    other.checks.forget(liar);
    if (!is_final(other.record.state)) other.liars.insert(liar);
  }
}

void Farm::Impl::take_back_lies() {
  std::vector<std::pair<JobId, RenderSettings>> doubtful;
  {
    const std::lock_guard lock(mutex);
    for (const Job* active : scheduler.active_jobs()) {
      if (!active->liars.empty()) doubtful.emplace_back(active->record.id, active->record.settings);
    }
  }
  for (const auto& [id, settings] : doubtful) {
    try {
      Merger::Open layers = open_layers(id, settings);
      take_back_lies(id, layers);
    } catch (const Error& error) {  // the disk: a later tick tries again, and the job does not end before
      log("job " + id.value + ": " + error.what());
    }
  }
}

void Farm::Impl::take_back_lies(const JobId& id, Merger::Open& layers) {
  const std::lock_guard lock(mutex);
  Job& doubtful = job(id);
  if (is_final(doubtful.record.state)) return;
  const double now = clock.now();
  for (const LeaseTable::Lease& lease : doubtful.tiles.leases()) {
    if (doubtful.liars.contains(lease.worker) && !is_pilot(doubtful.tiles.find(lease.tile)->tile))
      release(doubtful, lease, false, "", now);
  }
  const std::vector<TileId> kept_ids = store->kept_partials(id);
  const std::set<TileId> kept(kept_ids.begin(), kept_ids.end());
  std::vector<TileRecord> lies, others;
  bool all_kept = true;
  for (const TileRecord& tile : doubtful.tiles.tiles()) {
    if (tile.state != TileState::kCommitted || is_pilot(tile.tile)) continue;
    (doubtful.liars.contains(lease_tokens(tile).at(0).worker) ? lies : others).push_back(tile);
    all_kept = all_kept && kept.contains(tile.id);
  }
  if (lies.empty()) {
    doubtful.liars.clear();
    return;
  }
  JobRecord record = record_at(doubtful, now);
  record.target_met = false;
  if (all_kept) {
    for (const TileRecord& tile : lies) {
      const Partial partial = decode_partial(store->partial(id, tile.id));
      record.counters = difference(record.counters, partial.counters);
      record.pixel_samples -= partial.grid.pixels(tile.tile.cells).area() * tile.tile.samples();
      record.packets_done -= packets_completed(tile.tile, record.settings.spp);
      --record.tiles_committed;
    }
  } else {  // it began without spot checks: what the snapshot contains can't be taken out of it
    lies.insert(lies.end(), others.begin(), others.end());
    record.counters = {};
    record.pixel_samples = record.packets_done = record.tiles_committed = 0;
    record.quantum_exponent.reset();
  }
  for (TileRecord& tile : lies) {
    const WorkerId worker = lease_tokens(tile).at(0).worker;
    if (doubtful.liars.contains(worker)) doubtful.failed_on.insert({tile.id, worker});
    if (doubtful.checks.contains(tile.id))
      tile.attempt = std::max(tile.attempt, doubtful.checks.attempts(tile.id));
    tile = voided(tile);
    tile.digest.clear();
    tile.check = TileCheck::kNone;
  }
  store->take_back(record, lies);
  Merger::reset(layers);
  for (const TileRecord& tile : lies) {
    for (const LeaseTable::Lease& lease : doubtful.checks.leases()) {
      if (lease.tile == tile.id) end_check(doubtful, lease, 0);
    }
    doubtful.checks.remove(tile.id);
    doubtful.tiles.apply(tile);
  }
  doubtful.record = std::move(record);
  doubtful.liars.clear();
  doubtful.last_point.reset();
  doubtful.last_estimate.reset();
  stats.tiles_taken_back += lies.size();
  log("job " + id.value + ": " + std::to_string(lies.size()) + " tiles are rendered again");
  touch(doubtful);
}

void Farm::Impl::drop_lonely_checks(double now) {
  if (health.fault()) return;
  for (Job* active : scheduler.active_jobs()) {
    if (active->checks.empty() || !scheduler.rendered(*active, now)) {
      active->lonely_since = -1;
      continue;
    }
    bool lonely = true;
    for (const TileId& tile : active->checks.tiles()) {
      lonely = lonely && active->checks.votes(tile).size() == 1 && !scheduler.has_checker(*active, tile, now);
    }
    if (!lonely || active->lonely_since < 0) {
      active->lonely_since = lonely ? now : -1;
    } else if (now - active->lonely_since >= kCheckPatience * options.lease_seconds) {
      for (const TileId& tile : active->checks.tiles()) {
        TileRecord row = *active->tiles.find(tile);
        row.check = TileCheck::kNone;
        store->save_tile(record_at(*active, now), row);
        active->tiles.apply(row);
        active->checks.remove(tile);
        log(tile_name({active->record.id, tile, row.attempt}, false) + " stays unchecked: no second worker");
      }
    }
  }
}

}  // namespace lightmill
