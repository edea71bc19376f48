#include "coordinator/core/leases.h"

#include <cmath>
#include <utility>
#include <variant>
#include <vector>

#include "common/base/log.h"

namespace lightmill {
namespace {

/// Leases that end in silence are nobody's fault (a killed worker), up to a point.
constexpr int kSilentEndsPerAllowed = 10;
/// A job whose tiles fail this many times the allowed attempts in a row, without one commit, is hopeless.
constexpr int kRowOfFailures = 3;

}  // namespace

std::optional<LeaseGrant> Leases::grant(const WorkerId& worker, double now) {
  for (;;) {
    const Offer offer = farm_.scheduler.offer(worker, now);
    if (const auto* round = std::get_if<RoundOffer>(&offer)) {
      open_round(*round);
    } else if (const auto* cut = std::get_if<SplitOffer>(&offer)) {
      split(*cut);
    } else if (const auto* check = std::get_if<CheckOffer>(&offer)) {
      return grant_check(jobs_.get(check->job), check->tile, worker, now);
    } else if (const auto* lease = std::get_if<LeaseOffer>(&offer)) {
      return grant_tile(jobs_.get(lease->job), lease->tile, worker, now);
    } else {
      return std::nullopt;
    }
  }
}

void Leases::open_round(const RoundOffer& round) {
  Job& job = jobs_.get(round.job);
  std::vector<TileRecord> tiles;
  int64_t next = job.tiles.next_id();
  for (const TileSpec& spec : round.tiles) {
    TileRecord tile;
    tile.id = TileId{next++};
    tile.tile = spec;
    tiles.push_back(tile);
  }
  farm_.store->add_tiles(round.job, tiles);
  job.tiles.add(tiles);
}

void Leases::split(const SplitOffer& cut) {
  Job& job = jobs_.get(cut.job);
  const LeaseTable::Split parts = job.tiles.split(cut.tile, cut.parts);
  farm_.store->split_tile(cut.job, parts.smaller, parts.others);
  job.tiles.apply(parts);
  ++farm_.stats.tiles_split;
}

LeaseGrant Leases::grant_tile(Job& job, TileId id, const WorkerId& worker, double now) {
  const Worker& taker = *farm_.scheduler.workers.find(worker);
  const bool race = job.tiles.find(id)->state == TileState::kLeased;
  const TileRecord tile = job.tiles.leased_to(id, worker);
  JobRecord record = JobTable::record_at(job, now);
  record.state = JobState::kRunning;
  if (record.arithmetic_class.empty()) record.arithmetic_class = taker.registration.arithmetic_class;
  if (race) ++farm_.stats.races;
  if (tile.attempt > 1) ++record.leases_reassigned;
  farm_.store->save_tile(record, tile);
  job.record = std::move(record);
  job.running_since = now;
  job.tiles.apply(tile, now + farm_.options.lease_seconds, now);
  farm_.scheduler.granted(job, tile);
  farm_.scheduler.workers.leased(worker, job.record.id, now);
  ++farm_.stats.leases;
  farm_.touch_quietly(job);
  return {job.record.id,
          tile.id,
          tile.attempt,
          tile.tile,
          job.record.settings,
          job.record.bundle_digest,
          farm_.options.lease_seconds};
}

LeaseGrant Leases::grant_check(Job& job, TileId tile, const WorkerId& worker, double now) {
  const int64_t attempt = job.checks.lease(tile, worker, now + farm_.options.lease_seconds);
  TileRecord row = *job.tiles.find(tile);
  row.attempt = attempt;
  row.worker = worker;
  farm_.scheduler.granted(job, row);
  farm_.scheduler.workers.leased(worker, job.record.id, now);
  ++farm_.stats.leases;
  farm_.touch_quietly(job);
  return {job.record.id,
          tile,
          attempt,
          row.tile,
          job.record.settings,
          job.record.bundle_digest,
          farm_.options.lease_seconds};
}

bool Leases::holds(const Job& job, const WorkerId& worker, const LeaseKey& lease) {
  return job.tiles.holds(lease.tile, worker, lease.attempt) ||
         job.checks.holds(lease.tile, worker, lease.attempt);
}

bool Leases::renew(const WorkerId& worker, const LeaseKey& lease, double now) {
  Job* job = farm_.scheduler.jobs.find(lease.job);
  const double expires = now + farm_.options.lease_seconds;
  if (job && job->tiles.holds(lease.tile, worker, lease.attempt)) {
    job->tiles.renew(lease.tile, lease.attempt, expires);
    return true;
  }
  if (job && job->checks.holds(lease.tile, worker, lease.attempt)) {
    job->checks.renew(lease.tile, expires);
    return true;
  }
  return false;
}

void Leases::unpin(const WorkerId& worker, const LeaseKey& lease) {
  Job* job = farm_.scheduler.jobs.find(lease.job);
  if (job && job->tiles.holds(lease.tile, worker, lease.attempt)) {
    job->tiles.unpin(lease.tile, lease.attempt);
  } else if (job && job->checks.holds(lease.tile, worker, lease.attempt)) {
    job->checks.unpin(lease.tile);
  }
}

void Leases::release(Job& job, const LeaseTable::Lease& lease, bool failed, const std::string& reason,
                     double now) {
  const TileRecord record = job.tiles.released(lease.tile, lease.attempt, failed);
  farm_.store->save_tile(JobTable::record_at(job, now), record);
  job.tiles.apply(record);
  farm_.scheduler.settled(job, lease.tile, lease.attempt, 0);
  farm_.scheduler.workers.released(lease.worker, job.record.id, false, now);
  if (failed) {
    job.failed_on.insert({lease.tile, lease.worker});
    ++job.failures_in_row;
  }
  farm_.touch(job);
  fail_if_hopeless(job, record, lease.worker, failed, reason, now);
}

void Leases::fail_if_hopeless(Job& job, const TileRecord& record, const WorkerId& worker, bool failed,
                              const std::string& reason, double now) {
  const int allowed = farm_.options.max_attempts;
  const bool often = record.failures >= allowed || job.failures_in_row >= kRowOfFailures * allowed;
  if (failed && often && farm_.scheduler.is_believed(job, record.id, now)) {
    const std::string times =
        record.failures > 1 ? std::to_string(record.failures) + " times, last " : std::string();
    jobs_.end(job, JobState::kFailed,
              tile_text(record) + " failed " + times + "on worker " + worker.value + ": " + reason, now);
  }
}

void Leases::fail_if_deadly(Job& job, const TileRecord& record, const WorkerId& worker, double now) {
  const int ends = ++job.silent_ends[record.id];
  if (ends < kSilentEndsPerAllowed * farm_.options.max_attempts) return;
  jobs_.end(job, JobState::kFailed,
            tile_text(record) + " was leased to " + std::to_string(ends) +
                " workers that never came back, last " + worker.value,
            now);
}

void Leases::release(const WorkerId& worker, const LeaseKey& key, bool failed, const std::string& reason,
                     double now) {
  Job* owner = farm_.scheduler.jobs.find(key.job);
  if (owner && owner->checks.holds(key.tile, worker, key.attempt)) {
    release_check(*owner, {key.tile, key.attempt, worker});
    return;
  }
  if (!owner || !owner->tiles.holds(key.tile, worker, key.attempt)) return;
  release(*owner, {key.tile, key.attempt, worker}, failed, reason, now);
}

void Leases::release_check(Job& job, const LeaseTable::Lease& lease) {
  end_check(job, lease, 0);
  job.checks.release(lease.tile);
  farm_.touch(job);
}

void Leases::end_check(Job& job, const LeaseTable::Lease& lease, double cpu_seconds) {
  farm_.scheduler.workers.released(lease.worker, job.record.id, cpu_seconds > 0, farm_.clock.now());
  farm_.scheduler.settled(job, lease.tile, lease.attempt, cpu_seconds);
}

void Leases::store_lease(Job& job, const LeaseKey& lease, double now) {
  const TileRecord row = job.tiles.with_stored(lease.tile, lease.attempt);
  if (row == *job.tiles.find(lease.tile)) return;
  farm_.store->save_tile(JobTable::record_at(job, now), row);
  job.tiles.apply(row);
}

void Leases::log_end(const Job& job, const LeaseTable::Lease& lease, const std::string& how) const {
  const LeaseKey key{job.record.id, lease.tile, lease.attempt};
  const LogScope scope({key.job.value, key.tile.value, key.attempt, lease.worker.value});
  farm_.log("lease of " + tile_name(key, is_pilot(job.tiles.find(lease.tile)->tile)) + " by " +
            lease.worker.value + " " + how);
}

void Leases::release_overdue(double now) {
  if (farm_.health.fault()) {
    farm_.undisturbed_since = now;
    return;
  }
  for (Job* active : farm_.scheduler.jobs.in_work()) {
    for (const LeaseTable::Lease& lease : farm_.scheduler.overdue(*active, farm_.undisturbed_since, now)) {
      if (is_final(active->record.state)) break;
      log_end(
          *active, lease,
          "ended: it took " + std::to_string(std::lround(now - lease.since)) + " s, and others can do it");
      ++active->overdue[lease.tile];
      farm_.scheduler.workers.undelivered(lease.worker, now);
      release(*active, lease, false, "", now);
    }
  }
}

void Leases::release_expired(double now) {
  if (farm_.health.fault()) return;  // nothing can be recorded; workers that live keep renewing
  for (Job* active : farm_.scheduler.jobs.in_work()) {
    for (const LeaseTable::Lease& lease : active->tiles.expired(now)) {
      if (is_final(active->record.state)) break;
      ++farm_.stats.leases_expired;
      log_end(*active, lease, "expired");
      release(*active, lease, false, "", now);
      const Worker* worker = farm_.scheduler.workers.find(lease.worker);
      if (worker && farm_.scheduler.workers.was_heard(*worker, now)) {  // it lives, and does not renew
        farm_.scheduler.workers.undelivered(lease.worker, now);
      } else if (!is_final(active->record.state)) {
        fail_if_deadly(*active, *active->tiles.find(lease.tile), lease.worker, now);
      }
    }
    for (const LeaseTable::Lease& lease : active->checks.expired(now)) {
      ++farm_.stats.leases_expired;
      release_check(*active, lease);
    }
  }
}

void Leases::apply_commit(Job& job, JobRecord record, const TileRecord& tile, const LeaseKey& lease,
                          double cpu_seconds, double now) {
  for (const LeaseTable::Lease& ended : job.tiles.leases_of(tile.id)) {
    const bool counted = ended.attempt == lease.attempt;
    farm_.scheduler.workers.released(ended.worker, job.record.id, counted, now);
    farm_.scheduler.settled(job, tile.id, ended.attempt, counted ? cpu_seconds : 0);
  }
  job.record = std::move(record);
  if (job.running_since >= 0) job.running_since = now;
  job.tiles.apply(tile);
  jobs_.forget_old_tiles(job);
  job.failures_in_row = 0;
  job.silent_ends.erase(tile.id);
  job.overdue.erase(tile.id);
  std::erase_if(job.unable, [&](const auto& report) {
    if (report.second != FailureKind::kScene) return false;
    farm_.scheduler.workers.failed(report.first, now);  // it can be rendered after all
    return true;
  });
  ++farm_.stats.commits;
}

CommitResult Leases::standing(const WorkerId& worker, const LeaseKey& lease) {
  const std::lock_guard lock(farm_.mutex);
  Job* owner = farm_.scheduler.jobs.find(lease.job);
  if (owner && owner->tiles.holds(lease.tile, worker, lease.attempt)) return CommitResult::kAccepted;
  const TileRecord* tile = owner ? owner->tiles.find(lease.tile) : nullptr;
  if (tile && committed_under(*tile, {lease.attempt, worker})) {
    ++farm_.stats.commits_repeated;
    return CommitResult::kAlreadyCommitted;
  }
  ++farm_.stats.commits_stale;
  return CommitResult::kStale;
}

}  // namespace lightmill
