// The workers' half of Farm: registration, leases, renewals, failures. Commits are in farm_merge.cc.
#include <algorithm>
#include <chrono>

#include "coordinator/core/farm_impl.h"

namespace lightmill {
namespace {

/// Somebody must look at expiries even where no timer calls tick().
constexpr std::chrono::seconds kLookAgain(1);


}  // namespace

WorkerId Farm::register_worker(const WorkerRegistration& registration, const std::string& owner) {
  std::string refusal;
  const char* kind = "worker_build";
  if (registration.build != impl_->options.build) {
    refusal = "worker of another build: it is \"" + printable(registration.build) +
              "\", the coordinator is \"" + impl_->options.build + "\"; install the same version on both";
  } else if (registration.schema != impl_->options.schema) {
    kind = "worker_schema";
    refusal = "worker of another schema: it writes partials of schema " +
              std::to_string(registration.schema) + ", the coordinator reads " +
              std::to_string(impl_->options.schema) + "; install the same version on both";
  } else if (registration.threads < 1) {
    throw Error(ErrorKind::kUsage, "a worker needs at least one thread");
  }
  // A thousand workers come at once when a coordinator is back: the disk keeps none of them waiting for those
  // before it, nor those who work.
  WorkerId id{numbered("w", impl_->store->next_number("worker"))};
  if (refusal.empty()) impl_->store->flush();
  const std::lock_guard lock(impl_->mutex);
  const double now = impl_->clock.now();
  if (!refusal.empty()) {
    ++impl_->stats.refusals[kind];
    impl_->scheduler.workers.add_refused(id, registration, refusal, now);
    impl_->log("refused " + printable(registration.host) + ": " + refusal);
    throw Error(ErrorKind::kUnreachable, refusal);
  }
  try {
    impl_->scheduler.workers.add(id, registration, owner, now);
  } catch (const Error&) {
    ++impl_->stats.refusals["worker_limit"];
    throw;
  }
  impl_->work.notify_all();
  return id;
}

void Farm::turned_away(const std::string& reason) {
  const std::lock_guard lock(impl_->mutex);
  impl_->scheduler.workers.add_refused(WorkerId{"-"}, {}, reason, impl_->clock.now());
}

std::optional<LeaseGrant> Farm::Impl::try_lease(const WorkerId& worker, double now) {
  for (;;) {
    const Offer offer = scheduler.offer(worker, now);
    if (const auto* round = std::get_if<RoundOffer>(&offer)) {
      Job& target = job(round->job);
      std::vector<TileRecord> tiles;
      int64_t next = target.tiles.next_id();
      for (const TileSpec& spec : round->tiles) {
        TileRecord tile;
        tile.id = TileId{next++};
        tile.tile = spec;
        tiles.push_back(tile);
      }
      store->add_tiles(round->job, tiles);
      target.tiles.add(tiles);
      continue;
    }
    if (const auto* check = std::get_if<CheckOffer>(&offer))
      return lease_check(job(check->job), check->tile, worker, now);
    if (const auto* cut = std::get_if<SplitOffer>(&offer)) {
      Job& target = job(cut->job);
      const LeaseTable::Split split = target.tiles.split(cut->tile, cut->parts);
      store->split_tile(cut->job, split.smaller, split.others);
      target.tiles.apply(split);
      ++stats.tiles_split;
      continue;
    }
    const auto* lease = std::get_if<LeaseOffer>(&offer);
    if (!lease) return std::nullopt;
    Job& target = job(lease->job);
    Worker& taker = *scheduler.workers.find(worker);
    const bool race = target.tiles.find(lease->tile)->state == TileState::kLeased;
    const TileRecord tile = target.tiles.leased_to(lease->tile, worker);
    JobRecord record = record_at(target, now);
    record.state = JobState::kRunning;
    if (record.arithmetic_class.empty()) record.arithmetic_class = taker.registration.arithmetic_class;
    if (race) ++stats.races;
    if (tile.attempt > 1) ++record.leases_reassigned;
    store->save_tile(record, tile);
    target.record = std::move(record);
    target.running_since = now;
    target.tiles.apply(tile, now + options.lease_seconds, now);
    scheduler.granted(target, tile);
    ++taker.leases;
    ++stats.leases;
    touch_quietly(target);
    return LeaseGrant{target.record.id,       tile.id,
                      tile.attempt,           tile.tile,
                      target.record.settings, target.record.bundle_digest,
                      options.lease_seconds};
  }
}

std::optional<LeaseGrant> Farm::lease(const WorkerId& worker_id, double wait_s) {
  const auto end = std::chrono::steady_clock::now() +
                   std::chrono::duration<double>(std::clamp(wait_s, 0.0, kMaxWaitSeconds));
  std::unique_lock lock(impl_->mutex);
  Worker* worker = impl_->scheduler.workers.find(worker_id);
  if (!worker) throw UnknownWorker(worker_id);
  // A polling worker is never forgotten, so the pointer stays good.
  struct Polling {
    Worker* worker;
    explicit Polling(Worker* w) : worker(w) { ++worker->polling; }
    ~Polling() { --worker->polling; }
    Polling(const Polling&) = delete;
    Polling& operator=(const Polling&) = delete;
  };
  const Polling polling(worker);
  for (;;) {
    const double now = impl_->clock.now();
    worker->last_seen = now;
    worker->asked = true;
    impl_->release_expired(now);
    if (impl_->stopping || worker->draining) return std::nullopt;
    if (!impl_->health.fault()) {
      if (std::optional<LeaseGrant> grant = impl_->try_lease(worker_id, now)) return grant;
    }
    if (!impl_->complete_jobs(now).empty()) {
      lock.unlock();
      impl_->settle_complete();
      lock.lock();
      continue;
    }
    const auto real_now = std::chrono::steady_clock::now();
    if (real_now >= end) return std::nullopt;
    impl_->work.wait_until(lock, std::min<std::chrono::steady_clock::time_point>(
                                     std::chrono::time_point_cast<std::chrono::steady_clock::duration>(end),
                                     real_now + kLookAgain));
  }
}

std::optional<LeaseGrant> Farm::lease_at_once(const WorkerId& worker_id) {
  const std::lock_guard lock(impl_->mutex);
  Worker* worker = impl_->scheduler.workers.find(worker_id);
  if (!worker) throw UnknownWorker(worker_id);
  const double now = impl_->clock.now();
  worker->last_seen = now;
  worker->asked = true;
  impl_->release_expired(now);
  if (impl_->stopping || worker->draining || impl_->health.fault()) return std::nullopt;
  return impl_->try_lease(worker_id, now);
}

std::vector<LeaseKey> Farm::renew(const WorkerId& worker, const std::vector<LeaseKey>& held) {
  const std::lock_guard lock(impl_->mutex);
  if (!impl_->scheduler.workers.find(worker)) throw UnknownWorker(worker);
  const double now = impl_->clock.now();
  impl_->scheduler.workers.seen(worker, now);
  impl_->release_expired(now);
  std::vector<LeaseKey> lost;
  for (const LeaseKey& key : held) {
    Job* job = impl_->scheduler.find(key.job);
    if (job && job->tiles.holds(key.tile, worker, key.attempt)) {
      job->tiles.renew(key.tile, key.attempt, now + impl_->options.lease_seconds);
    } else if (job && job->checks.holds(key.tile, worker, key.attempt)) {
      job->checks.renew(key.tile, now + impl_->options.lease_seconds);
    } else {
      lost.push_back(key);
    }
  }
  return lost;
}

void Farm::fail(const WorkerId& worker, const LeaseKey& key, const std::string& reason) {
  const std::lock_guard lock(impl_->mutex);
  const double now = impl_->clock.now();
  impl_->scheduler.workers.seen(worker, now);
  Job* job = impl_->scheduler.find(key.job);
  if (!job || !(job->tiles.holds(key.tile, worker, key.attempt) ||
                job->checks.holds(key.tile, worker, key.attempt))) {
    return;
  }
  ++impl_->stats.failures;
  impl_->scheduler.workers.failed(worker, now);
  impl_->log("worker " + worker.value + " failed " +
             tile_name(key, is_pilot(job->tiles.find(key.tile)->tile)) + ": " + reason);
  impl_->release(worker, key, true, reason, now);
}

void Farm::warn(const WorkerId& worker, const LeaseKey& key, const std::vector<std::string>& missing_light) {
  if (missing_light.empty() || missing_light.size() > kMaxMissingLight)
    throw Error(ErrorKind::kUsage, "missing_light has 1 to " + std::to_string(kMaxMissingLight) + " lines");
  for (const std::string& line : missing_light) {
    if (line.empty() || line.size() > kMaxNoteBytes) {
      throw Error(ErrorKind::kUsage,
                  "a line of missing_light has 1 to " + std::to_string(kMaxNoteBytes) + " bytes");
    }
  }
  const std::lock_guard lock(impl_->mutex);
  const double now = impl_->clock.now();
  impl_->scheduler.workers.seen(worker, now);
  Job* job = impl_->scheduler.find(key.job);
  if (!job ||
      !(job->tiles.holds(key.tile, worker, key.attempt) ||
        job->checks.holds(key.tile, worker, key.attempt)) ||
      job->record.missing_light == missing_light) {
    return;
  }
  JobRecord record = impl_->record_at(*job, now);
  record.missing_light = missing_light;
  impl_->update(*job, std::move(record), now);
}

void Farm::hand_back(const WorkerId& worker, const LeaseKey& key) {
  const std::lock_guard lock(impl_->mutex);
  const double now = impl_->clock.now();
  impl_->scheduler.workers.seen(worker, now);
  impl_->release(worker, key, false, "", now);
}

void Farm::drain(const WorkerId& worker) {
  const std::lock_guard lock(impl_->mutex);
  Worker* found = impl_->scheduler.workers.find(worker);
  if (!found) throw UnknownWorker(worker);
  found->draining = true;
  impl_->work.notify_all();
}

void Farm::tick() {
  impl_->look_again();
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->release_expired(impl_->clock.now());
    impl_->drop_lonely_checks(impl_->clock.now());
  }
  impl_->take_back_lies();
  impl_->settle_complete();
}

}  // namespace lightmill
