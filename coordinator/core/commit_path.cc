#include "coordinator/core/commit_path.h"

#include <algorithm>
#include <exception>
#include <utility>
#include <vector>

#include "coordinator/farm/job_progress.h"
#include "coordinator/merge/expected_partial.h"

namespace lightmill {
CommitPath::CommitPath(FarmState& farm, StorageGuard& storage, Leases& leases, RoundEnds& ends,
                       SpotChecks& checks)
    : farm_(farm),
      storage_(storage),
      leases_(leases),
      ends_(ends),
      checks_(checks),
      pilots_(farm, leases),
      decoders_(farm.options.decode_memory_bytes) {}

CommitPath::Unpin::~Unpin() {
  const std::lock_guard lock(path.farm_.mutex);
  path.leases_.unpin(delivery.worker, delivery.lease);
}

CommitResult CommitPath::commit(const WorkerId& worker, const LeaseKey& lease, const std::string& bytes,
                                std::string* reason) {
  const Delivery delivery{worker, lease, bytes, reason};
  const std::variant<CommitResult, Claim> claimed = claim(delivery);
  if (const auto* answer = std::get_if<CommitResult>(&claimed)) return *answer;
  const Unpin unpin{*this, delivery};
  const Claim& pinned = std::get<Claim>(claimed);
  return is_pilot(pinned.tile) ? take_pilot(delivery) : take_partial(delivery, pinned);
}

std::variant<CommitResult, CommitPath::Held> CommitPath::look_up(const WorkerId& worker,
                                                                 const LeaseKey& lease) {
  farm_.scheduler.workers.seen(worker, farm_.clock.now());
  Job* job = farm_.scheduler.jobs.find(lease.job);
  if (!job || job->record.state == JobState::kCancelled) {
    ++farm_.stats.refusals["commit_unknown_job"];
    return CommitResult::kUnknownJob;
  }
  if (lease.tile.value >= 0 && lease.tile.value < job->tiles.forgotten()) {  // committed long ago
    ++farm_.stats.commits_stale;
    return CommitResult::kStale;
  }
  std::optional<TileRecord> tile = find_tile(*job, lease.tile);
  if (!tile) {
    ++farm_.stats.refusals["commit_unknown_job"];
    return CommitResult::kUnknownJob;
  }
  if (committed_under(*tile, {lease.attempt, worker})) {
    ++farm_.stats.commits_repeated;
    return CommitResult::kAlreadyCommitted;
  }
  storage_.require();  // the worker keeps its partial and tries again
  if (!Leases::holds(*job, worker, lease)) {
    ++farm_.stats.commits_stale;
    return CommitResult::kStale;
  }
  return Held{job, std::move(*tile)};
}

std::variant<CommitResult, uint64_t> CommitPath::announce(const WorkerId& worker, const LeaseKey& lease) {
  const std::lock_guard lock(farm_.mutex);
  const std::variant<CommitResult, Held> found = look_up(worker, lease);
  if (const auto* answer = std::get_if<CommitResult>(&found)) return *answer;
  const auto& [job, tile] = std::get<Held>(found);
  if (is_pilot(tile.tile)) return uint64_t{kMaxPilotResultBytes};
  const RenderSettings& settings = job->record.settings;
  return max_encoded_bytes(tile.tile, settings);
}

std::variant<CommitResult, CommitPath::Claim> CommitPath::claim(const Delivery& delivery) {
  const LeaseKey& lease = delivery.lease;
  const std::lock_guard lock(farm_.mutex);
  const std::variant<CommitResult, Held> found = look_up(delivery.worker, lease);
  if (const auto* answer = std::get_if<CommitResult>(&found)) return *answer;
  const auto& [job, tile] = std::get<Held>(found);
  const bool is_check = job->checks.holds(lease.tile, delivery.worker, lease.attempt);
  // Decoding and folding take a moment; the lease must not run out meanwhile.
  if (is_check) {
    job->checks.pin(lease.tile);
  } else {
    job->tiles.pin(lease.tile, lease.attempt);
  }
  return Claim{tile.tile, job->record.settings, job->record.quantum_exponent, is_check};
}

std::optional<TileRecord> CommitPath::find_tile(const Job& job, TileId id) const {
  if (job.ledger_loaded) {
    const TileRecord* found = job.tiles.find(id);
    return found ? std::optional(*found) : std::nullopt;
  }
  return farm_.store->tile(job.record.id, id);
}

CommitResult CommitPath::take_pilot(const Delivery& delivery) {
  PilotResult result;
  try {
    result = decode_pilot(delivery.bytes);
  } catch (const Error& e) {
    // The worker is told that it does not fit, the log says why.
    return refuse({delivery.worker, delivery.lease, delivery.bytes, nullptr}, e.what());
  }
  return pilots_.commit(delivery.worker, delivery.lease, result, delivery.bytes.size());
}

CommitResult CommitPath::take_partial(const Delivery& delivery, const Claim& claim) {
  std::optional<DecoderPool::Loan> decoder(decoders_.lend(decoded_bytes(claim.tile, claim.settings)));
  const Partial* decoded = nullptr;
  std::string digest;
  try {
    decoded = &(*decoder)->decode(delivery.bytes, claim.settings.grid, claim.tile,
                                  claim.settings.light_groups.size(), claim.settings.aovs);
    check_partial(*decoded, claim.tile, claim.settings, claim.quantum_exponent);
    digest = encoded_digest(delivery.bytes);
  } catch (const Error& e) {
    return refuse(delivery, e.what());
  }
  const Partial& partial = *decoded;  // while the decoder is ours
  if (claim.is_check) return checks_.commit(delivery.worker, delivery.lease, partial, digest, delivery.bytes);

  std::optional<Merger::Open> layers = open_layers(delivery, claim);
  if (!layers) return CommitResult::kStale;
  // A repeated call may have been faster.
  const CommitResult standing = leases_.standing(delivery.worker, delivery.lease);
  if (standing != CommitResult::kAccepted) return standing;
  try {
    (*layers)->film.fold(partial);
    (*layers)->batches.fold(partial);
  } catch (const Error& e) {
    Merger::reset(*layers);
    layers.reset();
    return refuse(delivery, e.what());
  }
  if (!record(delivery, claim, partial, digest, *layers)) return CommitResult::kStale;
  decoder.reset();
  settle(delivery, *layers);
  return CommitResult::kAccepted;
}

std::optional<Merger::Open> CommitPath::open_layers(const Delivery& delivery, const Claim& claim) {
  try {
    return storage_.open_layers(delivery.lease.job, claim.settings);
  } catch (const StoreError&) {
    throw;
  } catch (const Error&) {
    const std::lock_guard lock(farm_.mutex);
    leases_.release(delivery.worker, delivery.lease, false, "", farm_.clock.now());
    ++farm_.stats.commits_stale;
    return std::nullopt;
  }
}

bool CommitPath::record(const Delivery& delivery, const Claim& claim, const Partial& partial,
                        const std::string& digest, Merger::Open& layers) {
  try {
    const std::lock_guard lock(farm_.mutex);
    if (record_locked(delivery, claim, partial, digest)) return true;
    Merger::reset(layers);
    ++farm_.stats.commits_stale;
    return false;
  } catch (...) {
    Merger::reset(layers);
    throw;
  }
}

bool CommitPath::record_locked(const Delivery& delivery, const Claim& claim, const Partial& partial,
                               const std::string& digest) {
  const LeaseKey& lease = delivery.lease;
  Job* job = farm_.scheduler.jobs.find(lease.job);
  if (!job || !job->tiles.holds(lease.tile, delivery.worker, lease.attempt)) return false;
  const double now = farm_.clock.now();
  leases_.store_lease(*job, lease, now);
  TileRecord committed = job->tiles.committed(lease.tile, lease.attempt, digest);
  if (checks_.draw(delivery.worker)) committed.check = TileCheck::kWanted;
  JobRecord record = with_partial(JobTable::record_at(*job, now), partial, claim.tile, delivery.bytes.size());
  if (!farm_.store->commit_tile(record, committed, delivery.bytes)) return false;
  const double since = job->tiles.leased_since(lease.tile, lease.attempt);
  leases_.apply_commit(*job, std::move(record), committed, lease, partial.cpu_seconds, now);
  if (committed.check == TileCheck::kWanted) job->checks.add(committed);
  count(*job, delivery, claim, partial, since, now);
  if (job->tiles.has_pending()) {
    farm_.touch_quietly(*job);  // who waits although tiles are there can't take them
  } else {
    farm_.touch(*job);
  }
  return true;
}

void CommitPath::count(Job& job, const Delivery& delivery, const Claim& claim, const Partial& partial,
                       double since, double now) {
  const auto pixels = claim.settings.grid.pixels(claim.tile.cells).area();
  const auto samples = pixels * claim.tile.samples();
  count_commit(job.recent, now, static_cast<double>(samples));
  if (Sequence* sequence = farm_.scheduler.jobs.sequence_of(job))
    count_commit(sequence->recent, now, static_cast<double>(samples));
  if (const Worker* taker = farm_.scheduler.workers.find(delivery.worker)) {
    const double seconds = partial.cpu_seconds / std::max(1, taker->registration.threads);
    farm_.scheduler.workers.committed(delivery.worker, static_cast<double>(samples), seconds, since, now);
  }
  job.commit_bytes += static_cast<double>(delivery.bytes.size());
  job.commit_pixels += static_cast<double>(pixels);
  FarmStats& stats = farm_.stats;
  stats.commit_bytes += delivery.bytes.size();
  stats.packets += static_cast<uint64_t>(packets_completed(claim.tile, job.record.settings.spp));
  stats.pixel_samples += static_cast<uint64_t>(samples);
  stats.counters += partial.counters;
}

void CommitPath::settle(const Delivery& delivery, Merger::Open& layers) {
  const JobId& job = delivery.lease.job;
  try {
    layers->spool_bytes += static_cast<double>(delivery.bytes.size());
    ends_.settle(job, layers);
    if (layers->spool_bytes > farm_.options.checkpoint_bytes) farm_.merger.checkpoint(job, layers);
  } catch (const std::exception& e) {
    farm_.log("job " + job.value + ": " + e.what());
  }
}

CommitResult CommitPath::refuse(const Delivery& delivery, const std::string& why) {
  const LeaseKey& lease = delivery.lease;
  if (delivery.reason) *delivery.reason = why;
  farm_.keep_evidence(lease, delivery.worker, why, delivery.bytes);
  const std::lock_guard lock(farm_.mutex);
  const double now = farm_.clock.now();
  ++farm_.stats.commits_corrupt;
  farm_.scheduler.workers.refused(delivery.worker, now);
  Job* owner = farm_.scheduler.jobs.find(lease.job);
  const TileRecord* tile = owner ? owner->tiles.find(lease.tile) : nullptr;
  farm_.log(tile_name(lease, tile && is_pilot(tile->tile)) + " from worker " + delivery.worker.value + ": " +
            why);
  leases_.release(delivery.worker, lease, true, why, now);
  return CommitResult::kCorrupt;
}

}  // namespace lightmill
