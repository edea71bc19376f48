#include "coordinator/core/spot_checks.h"

#include <algorithm>
#include <set>
#include <utility>

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

WorkerId committer(const TileRecord& tile) { return lease_tokens(tile).at(0).worker; }

}  // namespace

SpotChecks::SpotChecks(FarmState& farm, JobTable& jobs, StorageGuard& storage, Leases& leases,
                       RoundEnds& ends)
    : farm_(farm),
      jobs_(jobs),
      storage_(storage),
      leases_(leases),
      ends_(ends),
      random_(farm.options.spot_check_seed ? farm.options.spot_check_seed : std::random_device{}()) {}

bool SpotChecks::draw(const WorkerId& worker) {
  if (farm_.options.spot_check <= 0) return false;
  const Worker* known = farm_.scheduler.workers.find(worker);
  if (known && known->convicted) return true;
  return std::uniform_int_distribution<int>(1, farm_.options.spot_check)(random_) == 1;
}

CommitResult SpotChecks::commit(const WorkerId& worker, const LeaseKey& lease, const Partial& partial,
                                const std::string& digest, const std::string& bytes) {
  std::string difference_text;
  {
    const std::lock_guard lock(farm_.mutex);
    Job* job = farm_.scheduler.jobs.find(lease.job);
    if (!job || !job->checks.holds(lease.tile, worker, lease.attempt)) {
      ++farm_.stats.commits_stale;
      return CommitResult::kStale;
    }
    difference_text = vote(*job, worker, lease, partial, digest);
  }
  if (!difference_text.empty()) {
    farm_.keep_evidence(lease, worker, "spot check of " + difference_text, bytes);
    farm_.keep_evidence(lease, worker, "spot check of " + difference_text + "; this is what was committed",
                        farm_.store->partial(lease.job, lease.tile));
  }
  take_back_lies();
  ends_.settle_complete();
  return CommitResult::kAccepted;
}

std::string SpotChecks::vote(Job& job, const WorkerId& worker, const LeaseKey& lease, const Partial& partial,
                             const std::string& digest) {
  const double now = farm_.clock.now();
  const CheckTable::Outcome outcome = job.checks.vote(lease.tile, digest);
  leases_.end_check(job, {lease.tile, lease.attempt, worker}, partial.cpu_seconds);
  ++farm_.stats.checks;
  const std::vector<CheckTable::Vote> votes = job.checks.votes(lease.tile);
  const std::string what = tile_name(lease, false);
  if (outcome.hopeless) {
    jobs_.end(job, JobState::kFailed,
              "tile " + std::to_string(lease.tile.value) + " came out differently on workers " +
                  votes[0].worker.value + ", " + votes[1].worker.value + " and " + votes[2].worker.value +
                  ": the image can't be trusted; check those machines, then submit the job again",
              now);
  } else if (outcome.decided && outcome.first_is_right) {
    pass(job, lease.tile, now);
  }
  std::string difference_text;
  if (!outcome.decided || outcome.liar) {
    difference_text = what + ": " + worker.value + " rendered " + digest.substr(0, 12) + ", " +
                      votes[0].worker.value + " committed " + votes[0].digest.substr(0, 12);
    farm_.log("spot check of " + difference_text);
  }
  if (outcome.liar) convict(*outcome.liar, what, now);
  if (outcome.liar != worker) credit(worker, partial, now);
  farm_.touch(job);
  return difference_text;
}

void SpotChecks::pass(Job& job, TileId tile, double now) {
  TileRecord row = *job.tiles.find(tile);
  row.check = TileCheck::kPassed;
  farm_.store->save_tile(JobTable::record_at(job, now), row);
  job.tiles.apply(row);
  job.checks.remove(tile);
}

void SpotChecks::credit(const WorkerId& worker, const Partial& partial, double now) {
  const Worker* taker = farm_.scheduler.workers.find(worker);
  if (!taker) return;
  const TileSpec& tile = partial.tile;
  const auto samples = partial.grid.pixels(tile.cells).area() * tile.samples();
  const double seconds = partial.cpu_seconds / std::max(1, taker->registration.threads);
  farm_.scheduler.workers.committed(worker, static_cast<double>(samples), seconds, now - seconds, now);
}

void SpotChecks::convict(const WorkerId& liar, const std::string& what, double now) {
  ++farm_.stats.liars;
  farm_.scheduler.workers.convict(liar, now);
  farm_.log("worker " + liar.value + " rendered " + what +
            " wrongly: benched, and its tiles are rendered again");
  for (const JobId& id : farm_.scheduler.jobs.order()) {
    Job& other = jobs_.get(id);
    other.checks.forget(liar);
    if (!is_final(other.record.state)) other.liars.insert(liar);
  }
}

void SpotChecks::take_back_lies() {
  std::vector<std::pair<JobId, RenderSettings>> doubtful;
  {
    const std::lock_guard lock(farm_.mutex);
    for (const Job* active : farm_.scheduler.jobs.active_jobs()) {
      if (!active->liars.empty()) doubtful.emplace_back(active->record.id, active->record.settings);
    }
  }
  for (const auto& [id, settings] : doubtful) {
    try {
      Merger::Open layers = storage_.open_layers(id, settings);
      take_back_lies(id, layers);
    } catch (const Error& error) {  // the disk: a later tick tries again, and the job does not end before
      farm_.log("job " + id.value + ": " + error.what());
    }
  }
}

void SpotChecks::take_back_lies(const JobId& id, Merger::Open& layers) {
  const std::lock_guard lock(farm_.mutex);
  Job& job = jobs_.get(id);
  if (is_final(job.record.state)) return;
  const double now = farm_.clock.now();
  release_leases_of_liars(job, now);
  Retraction lies = retraction(job, now);
  if (lies.tiles.empty()) {
    job.liars.clear();
    return;
  }
  const size_t count = lies.tiles.size();
  retract(job, std::move(lies), layers);
  farm_.stats.tiles_taken_back += count;
  farm_.log("job " + id.value + ": " + std::to_string(count) + " tiles are rendered again");
  farm_.touch(job);
}

void SpotChecks::release_leases_of_liars(Job& job, double now) {
  for (const LeaseTable::Lease& lease : job.tiles.leases()) {
    if (is_final(job.record.state)) return;  // a tile that was leased too often has ended the job
    if (job.liars.contains(lease.worker) && !is_pilot(job.tiles.find(lease.tile)->tile))
      leases_.release(job, lease, false, "", now);
  }
}

SpotChecks::Retraction SpotChecks::retraction(const Job& job, double now) const {
  const JobId& id = job.record.id;
  const std::vector<TileId> kept_ids = farm_.store->kept_partials(id);
  const std::set<TileId> kept(kept_ids.begin(), kept_ids.end());
  std::vector<TileRecord> lies, others;
  bool all_kept = true;
  for (const TileRecord& tile : job.tiles.tiles()) {
    if (tile.state != TileState::kCommitted || is_pilot(tile.tile)) continue;
    (job.liars.contains(committer(tile)) ? lies : others).push_back(tile);
    all_kept = all_kept && kept.contains(tile.id);
  }
  if (lies.empty()) return {};
  JobRecord record = JobTable::record_at(job, now);
  record.target_met = false;
  if (all_kept) {
    for (const TileRecord& tile : lies) {
      const Partial partial = decode_partial(farm_.store->partial(id, tile.id));
      record.counters = difference(record.counters, partial.counters);
      record.dropped.subtract(partial.dropped);
      record.pixel_samples -= partial.grid.pixels(tile.tile.cells).area() * tile.tile.samples();
      record.packets_done -= packets_completed(tile.tile, record.settings.spp);
      --record.tiles_committed;
    }
  } else {  // it began without spot checks: what the snapshot contains can't be taken out of it
    lies.insert(lies.end(), others.begin(), others.end());
    record.counters = {};
    record.dropped = {};
    record.pixel_samples = record.packets_done = record.tiles_committed = 0;
    record.quantum_exponent.reset();
  }
  return {std::move(lies), std::move(record)};
}

void SpotChecks::retract(Job& job, Retraction retraction, Merger::Open& layers) {
  for (TileRecord& tile : retraction.tiles) {
    const WorkerId worker = committer(tile);
    if (job.liars.contains(worker)) job.failed_on.insert({tile.id, worker});
    if (job.checks.contains(tile.id)) tile.attempt = std::max(tile.attempt, job.checks.attempts(tile.id));
    tile = voided(tile);
    tile.digest.clear();
    tile.check = TileCheck::kNone;
  }
  farm_.store->take_back(retraction.record, retraction.tiles, {});
  Merger::reset(layers);
  for (const TileRecord& tile : retraction.tiles) {
    for (const LeaseTable::Lease& lease : job.checks.leases()) {
      if (lease.tile == tile.id) leases_.end_check(job, lease, 0);
    }
    job.checks.remove(tile.id);
    job.tiles.apply(tile);
  }
  job.record = std::move(retraction.record);
  job.liars.clear();
  job.last_point.reset();
  job.last_estimate.reset();
  job.last_denoised.reset();
  job.denoised_spp = 0;
}

void SpotChecks::drop_lonely(double now) {
  if (farm_.health.fault()) return;
  for (Job* active : farm_.scheduler.jobs.in_work()) {
    if (active->checks.empty() || !farm_.scheduler.rendered(*active, now)) {
      active->lonely_since = -1;
      continue;
    }
    bool lonely = true;
    for (const TileId& tile : active->checks.tiles()) {
      lonely = lonely && active->checks.votes(tile).size() == 1 &&
               !farm_.scheduler.has_checker(*active, tile, now);
    }
    if (!lonely || active->lonely_since < 0) {
      active->lonely_since = lonely ? now : -1;
    } else if (now - active->lonely_since >= kCheckPatience * farm_.options.lease_seconds) {
      give_up(*active, now);
    }
  }
}

void SpotChecks::give_up(Job& job, double now) {
  for (const TileId& tile : job.checks.tiles()) {
    TileRecord row = *job.tiles.find(tile);
    row.check = TileCheck::kNone;
    farm_.store->save_tile(JobTable::record_at(job, now), row);
    job.tiles.apply(row);
    job.checks.remove(tile);
    farm_.log(tile_name({job.record.id, tile, row.attempt}, false) + " stays unchecked: no second worker");
  }
}

}  // namespace lightmill
