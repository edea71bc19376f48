// Commits and the merge: Farm::commit, and what round and job ends ask for.
#include <algorithm>
#include <limits>

#include "common/error/metrics.h"
#include "common/job/light_path_count.h"
#include "coordinator/core/farm_impl.h"

namespace lightmill {
namespace {

/// A worker may report any time it likes; only plausible ones count.
constexpr double kMaxCpuSeconds = 1e7;

constexpr uint64_t kPartialOverhead = 1 << 20;
constexpr uint64_t kBytesPerSum = 48;    // three 128-bit sums
constexpr uint64_t kBytesPerSplat = 54;  // and its pixel
constexpr double kDecodedPerSum = 64, kDecodedPerSplat = 80;

/// Light paths that every honest partial of the tile has traced.
uint64_t expected_light_paths(const TileSpec& tile, const RenderSettings& settings) {
  const SamplingPlan plan = plan_of(settings);
  if (!(plan.strategies & kLightPaths)) return 0;
  uint64_t per_sample = 0;
  for (int y = tile.cells.y0; y < tile.cells.y1; ++y) {
    for (int x = tile.cells.x0; x < tile.cells.x1; ++x) {
      per_sample += static_cast<uint64_t>(
          light_paths_of_layer(plan.light_paths, settings.grid.pixels({x, y, x + 1, y + 1}).area()));
    }
  }
  return per_sample * static_cast<uint64_t>(tile.samples());
}

/// About the memory that a partial of the tile takes unpacked, with what it is unpacked from.
double decoded_bytes(const TileSpec& tile, const RenderSettings& settings) {
  const auto pixels = static_cast<double>(settings.grid.pixels(tile.cells).area());
  const auto window = static_cast<double>(settings.grid.crop.area());
  const double aovs =
      settings.aovs ? 2 * static_cast<double>(max_aov_bytes(static_cast<size_t>(pixels), settings.grid)) : 0;
  return kDecodedPerSum * pixels + (has_splat_layer(settings) ? kDecodedPerSplat * window : 0) + aovs;
}

}  // namespace

void check_partial(const Partial& partial, const TileSpec& tile, const RenderSettings& settings,
                   const std::optional<int>& quantum_exponent) {
  const auto refuse = [](const std::string& why) {
    throw Error(ErrorKind::kFailed, "partial refused: " + why);
  };
  if (quantum_exponent && partial.quantum_exponent != *quantum_exponent) {
    refuse("its quantum is 2^" + std::to_string(partial.quantum_exponent) + ", the job's is 2^" +
           std::to_string(*quantum_exponent));
  }
  const bool wants_camera = has_camera_layer(settings);
  if (partial.camera.empty() == wants_camera) {
    refuse(wants_camera ? "its camera layer is missing"
                        : "the job's strategies have no camera layer, but it brings one");
  }
  if (!has_splat_layer(settings) && !partial.splats.empty()) {
    refuse("the job's strategies make no splats, but it brings some");
  }
  const auto require_count = [&](const char* what, uint64_t count, uint64_t expected) {
    if (count == expected) return;
    refuse("it counts " + std::to_string(count) + " " + what + ", its tile has " + std::to_string(expected));
  };
  const uint64_t light_paths = expected_light_paths(tile, settings);
  require_count("light paths", partial.counters.light_paths, light_paths);
  require_count("light paths behind its splats", partial.light_paths,
                has_splat_layer(settings) ? light_paths : 0);
  const PathCount paths =
      wants_camera ? camera_paths_of(plan_of(settings).allocation, settings.grid, tile) : PathCount{};
  const uint64_t camera_paths = partial.counters.camera_paths;
  require_count("camera paths", camera_paths, std::clamp(camera_paths, paths.least, paths.most));
  if (partial.aovs.spec.set != settings.aovs) {
    refuse("it brings the AOVs \"" + aov_names(partial.aovs.spec.set) + "\", the job asked for \"" +
           aov_names(settings.aovs) + "\"");
  }
  if (!(partial.cpu_seconds >= 0 && partial.cpu_seconds <= kMaxCpuSeconds))
    refuse("its CPU time is out of range");
}

uint64_t Farm::max_partial_bytes(const LeaseKey& lease) const {
  const std::lock_guard lock(impl_->mutex);
  Job* job = impl_->scheduler.find(lease.job);
  if (!job) return 0;
  const FilmGrid& grid = job->record.settings.grid;
  // Without the ledger at hand, the tile may be as large as the crop window.
  const TileRecord* tile = job->tiles.find(lease.tile);
  if (tile && is_pilot(tile->tile)) return kMaxPilotResultBytes;
  const auto tile_pixels =
      static_cast<uint64_t>(tile ? grid.pixels(tile->tile.cells).area() : grid.crop.area());
  const uint64_t aovs = job->record.settings.aovs ? max_aov_bytes(static_cast<size_t>(tile_pixels), grid) : 0;
  return kPartialOverhead + tile_pixels * kBytesPerSum +
         static_cast<uint64_t>(grid.crop.area()) * kBytesPerSplat + aovs;
}

CommitResult Farm::Impl::refuse(const WorkerId& worker, const LeaseKey& lease, const std::string& reason,
                                const std::string& bytes) {
  keep_evidence(lease, worker, reason, bytes);
  const std::lock_guard lock(mutex);
  const double now = clock.now();
  ++stats.commits_corrupt;
  scheduler.workers.refused(worker, now);
  Job* owner = scheduler.find(lease.job);
  const TileRecord* tile = owner ? owner->tiles.find(lease.tile) : nullptr;
  log(tile_name(lease, tile && is_pilot(tile->tile)) + " from worker " + worker.value + ": " + reason);
  release(worker, lease, true, reason, now);
  return CommitResult::kCorrupt;
}

CommitResult Farm::Impl::standing(const WorkerId& worker, const LeaseKey& lease) {
  const std::lock_guard lock(mutex);
  Job* owner = scheduler.find(lease.job);
  if (owner && owner->tiles.holds(lease.tile, worker, lease.attempt)) return CommitResult::kAccepted;
  const TileRecord* tile = owner ? owner->tiles.find(lease.tile) : nullptr;
  if (tile && committed_under(*tile, {lease.attempt, worker})) {
    ++stats.commits_repeated;
    return CommitResult::kAlreadyCommitted;
  }
  ++stats.commits_stale;
  return CommitResult::kStale;
}

Farm::Impl::Unpin::~Unpin() {
  const std::lock_guard lock(farm.mutex);
  Job* owner = farm.scheduler.find(lease.job);
  if (owner && owner->tiles.holds(lease.tile, worker, lease.attempt)) {
    owner->tiles.unpin(lease.tile, lease.attempt);
  } else if (owner && owner->checks.holds(lease.tile, worker, lease.attempt)) {
    owner->checks.unpin(lease.tile);
  }
}

void Farm::flush() { impl_->store->flush(); }

CommitResult Farm::commit(const WorkerId& worker, const LeaseKey& lease, const std::string& partial_bytes,
                          std::string* reason) {
  const CommitResult result = commit_unflushed(worker, lease, partial_bytes, reason);
  if (must_be_durable(result)) flush();
  return result;
}

CommitResult Farm::commit_unflushed(const WorkerId& worker, const LeaseKey& lease,
                                    const std::string& partial_bytes, std::string* reason) {
  const auto refuse = [&](const std::string& why) {
    if (reason) *reason = why;
    return impl_->refuse(worker, lease, why, partial_bytes);
  };
  TileSpec tile;
  RenderSettings settings;
  std::optional<int> quantum;
  bool repeated = false, checks = false;
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->scheduler.workers.seen(worker, impl_->clock.now());
    Job* job = impl_->scheduler.find(lease.job);
    if (!job || job->record.state == JobState::kCancelled) {
      ++impl_->stats.refusals["commit_unknown_job"];
      return CommitResult::kUnknownJob;
    }
    std::optional<TileRecord> record;
    if (job->ledger_loaded) {
      if (const TileRecord* found = job->tiles.find(lease.tile)) record = *found;
      if (lease.tile.value >= 0 && lease.tile.value < job->tiles.forgotten()) {  // committed long ago
        ++impl_->stats.commits_stale;
        return CommitResult::kStale;
      }
    } else {
      const std::vector<TileRecord> stored = impl_->store->tiles(lease.job);
      if (lease.tile.value >= 0 && lease.tile.value < static_cast<int64_t>(stored.size())) {
        record = stored[static_cast<size_t>(lease.tile.value)];
      }
    }
    if (!record) {
      ++impl_->stats.refusals["commit_unknown_job"];
      return CommitResult::kUnknownJob;
    }
    if (committed_under(*record, {lease.attempt, worker})) {
      ++impl_->stats.commits_repeated;
      repeated = true;
    } else {
      impl_->require_storage();  // the worker keeps its partial and tries again
    }
    checks = job->checks.holds(lease.tile, worker, lease.attempt);
    if (!repeated && !checks && !job->tiles.holds(lease.tile, worker, lease.attempt)) {
      ++impl_->stats.commits_stale;
      return CommitResult::kStale;
    }
    // Decoding and folding take a moment; the lease must not run out meanwhile.
    if (checks) {
      job->checks.pin(lease.tile);
    } else {
      job->tiles.pin(lease.tile, lease.attempt);
    }
    tile = record->tile;
    settings = job->record.settings;
    quantum = job->record.quantum_exponent;
  }
  if (repeated) return CommitResult::kAlreadyCommitted;
  const Impl::Unpin unpin{*impl_, worker, lease};
  if (is_pilot(tile)) return impl_->commit_pilot(worker, lease, partial_bytes);

  std::optional<DecoderPool::Loan> decoder(impl_->decoders.lend(decoded_bytes(tile, settings)));
  const Partial* decoded = nullptr;
  std::string digest;
  try {
    decoded = &(*decoder)->decode(partial_bytes, settings.grid, tile);
    check_partial(*decoded, tile, settings, quantum);
    digest = encoded_digest(partial_bytes);
  } catch (const Error& e) {
    return refuse(e.what());
  }
  const Partial& partial = *decoded;  // while the decoder is ours
  if (checks) return impl_->commit_check(worker, lease, partial, digest, partial_bytes);

  std::optional<Merger::Open> layers;
  try {
    layers.emplace(impl_->open_layers(lease.job, settings));
  } catch (const StoreError&) {
    throw;
  } catch (
      const Error&) {  // damaged, and the job waits: the worker has better things to do than to wait with it
    const std::lock_guard lock(impl_->mutex);
    impl_->release(worker, lease, false, "", impl_->clock.now());
    ++impl_->stats.commits_stale;
    return CommitResult::kStale;
  }
  switch (impl_->standing(worker, lease)) {  // a repeated call may have been faster
    case CommitResult::kAccepted:
      break;
    case CommitResult::kAlreadyCommitted:
      return CommitResult::kAlreadyCommitted;
    default:
      return CommitResult::kStale;
  }
  try {
    (*layers)->film.fold(partial);
    (*layers)->batches.fold(partial);
  } catch (const Error& e) {
    Merger::reset(*layers);
    layers.reset();
    return refuse(e.what());
  }
  // Folded in memory, where nobody sees it before the layers are unlocked; now make it durable, or forget it.
  try {
    const std::lock_guard lock(impl_->mutex);
    Job* job = impl_->scheduler.find(lease.job);
    if (!job || !job->tiles.holds(lease.tile, worker, lease.attempt)) {
      Merger::reset(*layers);
      ++impl_->stats.commits_stale;
      return CommitResult::kStale;
    }
    const double now = impl_->clock.now();
    TileRecord committed = job->tiles.committed(lease.tile, lease.attempt, digest);
    if (impl_->draw_check(worker)) committed.check = TileCheck::kWanted;
    const auto pixel_samples = settings.grid.pixels(tile.cells).area() * tile.samples();
    const int64_t packets = packets_completed(tile, job->record.settings.spp);
    JobRecord record = impl_->record_at(*job, now);
    record.quantum_exponent = partial.quantum_exponent;
    record.cpu_seconds += partial.cpu_seconds;
    record.packets_done += packets;
    ++record.tiles_committed;
    record.pixel_samples += pixel_samples;
    record.commit_bytes += partial_bytes.size();
    record.counters += partial.counters;
    if (!impl_->store->commit_tile(record, committed, partial_bytes)) {
      Merger::reset(*layers);
      ++impl_->stats.commits_stale;
      return CommitResult::kStale;
    }
    const double since = job->tiles.leased_since(lease.tile, lease.attempt);
    impl_->apply_commit(*job, std::move(record), committed, lease, partial.cpu_seconds, now);
    if (committed.check == TileCheck::kWanted) job->checks.add(committed);
    Scheduler::count_commit(*job, now, static_cast<double>(pixel_samples));
    if (const Worker* taker = impl_->scheduler.workers.find(worker)) {
      const double seconds = partial.cpu_seconds / std::max(1, taker->registration.threads);
      impl_->scheduler.workers.committed(worker, static_cast<double>(pixel_samples), seconds, since, now);
    }
    job->commit_bytes += static_cast<double>(partial_bytes.size());
    job->commit_pixels += static_cast<double>(settings.grid.pixels(tile.cells).area());
    impl_->stats.commit_bytes += partial_bytes.size();
    impl_->stats.packets += static_cast<uint64_t>(packets);
    impl_->stats.pixel_samples += static_cast<uint64_t>(pixel_samples);
    impl_->stats.counters += partial.counters;
    if (job->tiles.has_pending()) {
      impl_->touch_quietly(*job);  // who waits although tiles are there can't take them
    } else {
      impl_->touch(*job);
    }
  } catch (...) {
    Merger::reset(*layers);
    throw;
  }

  decoder.reset();
  // The commit stands. What follows is housekeeping: if the disk fails now, a later tick tries again.
  try {
    (*layers)->spool_bytes += static_cast<double>(partial_bytes.size());
    impl_->settle(lease.job, *layers);
    if ((*layers)->spool_bytes > impl_->options.checkpoint_bytes)
      impl_->merger.checkpoint(lease.job, *layers);
  } catch (const std::exception& e) {
    impl_->log("job " + lease.job.value + ": " + e.what());
  }
  return CommitResult::kAccepted;
}

void Farm::Impl::evaluate(Merger::Open& layers, ErrorPoint* point) {
  layers->batches.estimate(point);
  if (layers->reference.data.empty()) return;
  const Metrics metrics = compare_images(layers->film.resolve(), layers->reference);
  point->true_relmse = metrics.relmse;
  point->true_relmse_trimmed = metrics.relmse_trimmed;
  point->true_flip = metrics.flip;
}

void Farm::Impl::settle(const JobId& id, Merger::Open& layers) {
  ErrorPoint point;
  bool fresh = false;
  {
    const std::lock_guard lock(mutex);
    Job& open = job(id);
    if (is_final(open.record.state)) return;
    open.batch_group = layers->batches.max_tile_superblocks();
    const double now = clock.now();
    if (!scheduler.complete(open, now) && !Scheduler::point_due(open)) return;
    point.wall_seconds = Scheduler::wall_seconds(open, now);
    point.cpu_seconds = open.record.cpu_seconds;
    point.spp = static_cast<double>(open.record.pixel_samples) /
                static_cast<double>(open.record.settings.grid.crop.area());
    fresh = !open.last_point || open.last_point->spp < point.spp;
  }
  if (fresh) evaluate(layers, &point);
  bool complete = false;
  {
    const std::lock_guard lock(mutex);
    Job& open = job(id);
    if (is_final(open.record.state)) return;
    const double now = clock.now();
    if (fresh) {
      store->add_point(id, point);
      open.last_point = point;
      if (point.relmse) open.last_estimate = point;
      if (meets_target(point, open.record.settings.target_error)) {
        JobRecord record = record_at(open, now);
        record.target_met = true;
        update(open, std::move(record), now);
      }
    }
    complete = scheduler.complete(open, now);
    if (complete) {
      end(open, JobState::kDone, "", now);
    } else {
      touch(open);
    }
  }
  const bool unfolded = layers->spool_bytes > 0 || options.spot_check > 0;  // or kept
  if (complete && unfolded) merger.checkpoint(id, layers, true);
}

void Farm::Impl::settle(const JobId& id) {
  RenderSettings settings;
  {
    const std::lock_guard lock(mutex);
    settings = job(id).record.settings;
  }
  Merger::Open layers = open_layers(id, settings);
  settle(id, layers);
}

void Farm::Impl::settle_complete() {
  std::vector<JobId> ids;
  {
    const std::lock_guard lock(mutex);
    ids = complete_jobs(clock.now());
  }
  for (const JobId& id : ids) {
    try {
      settle(id);
    } catch (const Error& error) {  // its disk; other jobs go on, and a later tick tries again
      log("job " + id.value + ": " + error.what());
    }
  }
}

}  // namespace lightmill
