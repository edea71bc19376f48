#include "coordinator/core/farm.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "common/error/metrics.h"
#include "coordinator/core/farm_impl.h"

namespace lightmill {
namespace {

constexpr size_t kMaxNameBytes = 1000, kMaxAfter = 1000;
constexpr int kMaxMaxWorkers = 100000;

/// "job j1 is done; only a job that is running can be paused"
Error wrong_state(const JobRecord& job, const char* wanted, const char* verb) {
  return {ErrorKind::kFailed, "job " + job.id.value + " is " + job_state_name(job.state) +
                                  "; only a job that is " + wanted + " can be " + verb};
}

std::string number_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

int64_t count_packets(const std::vector<TileRecord>& ledger, int64_t spp) {
  int64_t packets = 0;
  for (const TileRecord& tile : ledger) {
    if (tile.state == TileState::kCommitted) packets += packets_completed(tile.tile, spp);
  }
  return packets;
}

JobState runnable_state(const Job& job) {
  const auto& tiles = job.tiles.tiles();
  const bool begun =
      job.tiles.forgotten() > 0 ||
      std::any_of(tiles.begin(), tiles.end(), [](const TileRecord& t) { return t.attempt > 0; });
  return begun ? JobState::kRunning : JobState::kQueued;
}

}  // namespace

Farm::Farm(std::unique_ptr<JobStore> store, const Clock& clock, const FarmOptions& options)
    : impl_(std::make_unique<Impl>(std::move(store), clock, options)) {
  impl_->settle_complete();
}
Farm::~Farm() = default;

JobId Farm::submit(const JobRequest& request) {
  const RenderSettings settings =
      settings_from_json(settings_to_json(request.settings));  // checks the ranges
  for (const std::string* text : {&request.name, &request.pool, &request.submitter}) {
    if (text->size() <= kMaxNameBytes) continue;
    throw Error(ErrorKind::kUsage, "name, pool and submitter may have at most 1000 bytes");
  }
  if (request.max_workers < 0 || request.max_workers > kMaxMaxWorkers) {
    throw Error(ErrorKind::kUsage, "a job's limit of workers must be 1 to 100000, or 0 for none");
  }
  if (request.after.size() > kMaxAfter) {
    throw Error(ErrorKind::kUsage, "a job may come after at most 1000 others");
  }
  const Image& reference = request.reference;
  const PixelRect& crop = settings.grid.crop;
  if (!reference.data.empty() &&
      (reference.width != crop.width() || reference.height != crop.height() || reference.channels != 3)) {
    throw Error(ErrorKind::kUsage, "the reference image is " + std::to_string(reference.width) + "x" +
                                       std::to_string(reference.height) + ", the job renders " +
                                       std::to_string(crop.width()) + "x" + std::to_string(crop.height()) +
                                       "; give one of the same size");
  }
  if (!reference.data.empty()) check_comparable(reference, "reference");
  Job job;
  job.record.name = request.name;
  job.record.bundle_digest = request.bundle.digest();
  job.record.settings = settings;
  job.record.priority = request.priority;
  job.record.pool = request.pool;
  job.record.submitter = request.submitter;
  job.record.max_workers = request.max_workers;
  job.record.after = request.after;
  const std::string bundle_json = bundle_to_json(request.bundle);

  const std::lock_guard lock(impl_->mutex);
  for (const JobId& id : request.after) impl_->job(id);  // throws UnknownJob
  if (impl_->scheduler.order().size() >= Impl::kMaxJobs) {
    ++impl_->stats.refusals["job_limit"];
    throw LimitReached("the coordinator has its limit of " + std::to_string(Impl::kMaxJobs) +
                       " jobs; start one with a new data folder");
  }
  if (impl_->scheduler.active().size() >= impl_->options.max_open_jobs) {
    ++impl_->stats.refusals["job_limit"];
    throw LimitReached("there are " + std::to_string(impl_->options.max_open_jobs) +
                       " jobs that have not ended (the coordinator's --max-open-jobs); wait, or cancel some");
  }
  job.record.id = JobId{numbered("j", impl_->store->next_number("job"))};
  impl_->store->add_job(job.record, bundle_json, reference);
  impl_->touch(impl_->scheduler.add(std::move(job)));
  return impl_->scheduler.order().back();
}

std::vector<JobStatus> Farm::jobs(size_t begin, size_t count) const {
  const std::lock_guard lock(impl_->mutex);
  const double now = impl_->clock.now();
  const std::vector<JobId>& order = impl_->scheduler.order();
  std::vector<JobStatus> result;
  begin = std::min(begin, order.size());
  const size_t end = begin + std::min(count, order.size() - begin);
  for (size_t i = begin; i < end; ++i) result.push_back(impl_->status(impl_->job(order[i]), now));
  return result;
}

std::vector<JobStatus> Farm::jobs() const {
  const size_t count = job_count();
  return jobs(count - std::min(count, Impl::kMaxListedJobs), Impl::kMaxListedJobs);
}

size_t Farm::job_count() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->scheduler.order().size();
}

JobStatus Farm::job(const JobId& id) const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->status(impl_->job(id), impl_->clock.now());
}

std::vector<TileStatus> Farm::tiles(const JobId& id) const {
  std::vector<TileRecord> records;
  {
    const std::lock_guard lock(impl_->mutex);
    records = impl_->ledger(impl_->job(id));
  }
  std::vector<TileStatus> result;
  result.reserve(records.size());
  for (const TileRecord& tile : records) result.push_back(tile_status(tile));
  return result;
}

ErrorCurve Farm::curve(const JobId& id) const {
  const std::lock_guard lock(impl_->mutex);
  return {impl_->job(id).record.name, impl_->store->curve(id)};
}

Image Farm::image(const JobId& id) const {
  RenderSettings settings;
  {
    const std::lock_guard lock(impl_->mutex);
    settings = impl_->job(id).record.settings;
  }
  const Merger::Open layers = impl_->open_layers(id, settings);
  return layers->film.resolve();
}

ChannelImage Farm::aovs(const JobId& id, Image* image) const {
  RenderSettings settings;
  {
    const std::lock_guard lock(impl_->mutex);
    settings = impl_->job(id).record.settings;
  }
  const Merger::Open layers = impl_->open_layers(id, settings);
  if (image) *image = layers->film.resolve();
  return layers->film.resolve_aovs();
}

std::map<std::string, std::string> Farm::image_metadata(const JobId& id) const {
  const std::lock_guard lock(impl_->mutex);
  const Job& job = impl_->job(id);
  const JobStatus s = impl_->status(job, impl_->clock.now());
  std::map<std::string, std::string> metadata = {{"job", s.id.value},
                                                 {"name", s.name},
                                                 {"state", job_state_name(s.state)},
                                                 {"scene", s.bundle_digest},
                                                 {"settings", settings_to_json(s.settings)},
                                                 {"integrator", integrator_name(s.settings.integrator)},
                                                 {"spp", std::to_string(s.spp)},
                                                 {"wall_seconds", std::to_string(s.wall_seconds)},
                                                 {"cpu_seconds", std::to_string(s.cpu_seconds)},
                                                 {"nonfinite", std::to_string(s.counters.nonfinite)},
                                                 {"arithmetic_class", job.record.arithmetic_class},
                                                 {"build", impl_->options.build}};
  if (!needs_pilot(s.settings)) metadata["plan"] = plan_to_json(plan_of(s.settings));
  for (const auto& [key, value] :
       {std::pair{"relmse", s.relmse}, {"relmse_low", s.relmse_low}, {"relmse_high", s.relmse_high}}) {
    if (value) metadata[key] = number_text(*value);
  }
  return metadata;
}

Bundle Farm::bundle(const std::string& bundle_digest) const {
  const std::optional<std::string> text = impl_->store->bundle_json(bundle_digest);
  if (!text) throw Error(ErrorKind::kFailed, "no job has the bundle " + bundle_digest);
  return bundle_from_json(*text);
}

void Farm::pause(const JobId& id) {
  const std::lock_guard lock(impl_->mutex);
  Job& job = impl_->job(id);
  if (job.record.state != JobState::kQueued && job.record.state != JobState::kRunning) {
    throw wrong_state(job.record, "queued or running", "paused");
  }
  const double now = impl_->clock.now();
  JobRecord record = impl_->record_at(job, now);
  record.state = JobState::kPaused;
  impl_->update(job, std::move(record), now);
  job.running_since = -1;
}

void Farm::resume(const JobId& id) {
  const std::lock_guard lock(impl_->mutex);
  Job& job = impl_->job(id);
  if (job.record.state != JobState::kPaused) {
    throw wrong_state(job.record, "paused", "resumed");
  }
  JobRecord record = job.record;
  record.state = runnable_state(job);
  impl_->update(job, std::move(record), impl_->clock.now());
}

void Farm::cancel(const JobId& id) {
  const std::lock_guard lock(impl_->mutex);
  Job& job = impl_->job(id);
  if (is_final(job.record.state)) {
    throw wrong_state(job.record, "queued, running or paused", "cancelled");
  }
  impl_->end(job, JobState::kCancelled, "cancelled by a client", impl_->clock.now());
}

void Farm::retry(const JobId& id) {
  const std::lock_guard lock(impl_->mutex);
  Job& job = impl_->job(id);
  if (job.record.state != JobState::kFailed && job.record.state != JobState::kCancelled) {
    throw wrong_state(job.record, "failed or cancelled", "retried");
  }
  impl_->load_ledger(job);
  const double now = impl_->clock.now();
  std::vector<TileRecord> forgiven;
  for (const TileRecord& tile : job.tiles.tiles()) {
    if (tile.failures == 0) continue;
    forgiven.push_back(tile);
    forgiven.back().failures = 0;
  }
  for (const TileRecord& tile : forgiven) {
    impl_->store->save_tile(job.record, tile);
    job.tiles.apply(tile);
  }
  job.failures_in_row = 0;
  JobRecord record = job.record;
  record.state = runnable_state(job);
  record.message.clear();
  impl_->update(job, std::move(record), now);
}

void Farm::extend(const JobId& id, std::optional<int64_t> spp, std::optional<double> time_s,
                  std::optional<double> target_error) {
  {
    const std::lock_guard lock(impl_->mutex);
    Job& job = impl_->job(id);
    if (job.record.state == JobState::kFailed || job.record.state == JobState::kCancelled) {
      throw Error(ErrorKind::kFailed, "job " + id.value + " is " + job_state_name(job.record.state) +
                                          "; run `lightmill retry` before extending it");
    }
    if ((spp && *spp < 1) || (time_s && !(*time_s >= 0)) || (target_error && !(*target_error >= 0))) {
      throw Error(ErrorKind::kUsage,
                  "extend: samples must be at least 1, a time and a target error at least 0");
    }
    RenderSettings settings = job.record.settings;
    if (spp || time_s || target_error) {
      // The new totals replace the old ones: a job that had run out of time goes on to the samples asked for.
      settings.spp = spp.value_or(kMaxSpp);
      settings.time_s = time_s.value_or(0);
      settings.target_error = target_error.value_or(0);
    }
    settings = settings_from_json(settings_to_json(settings));  // checks the ranges
    impl_->load_ledger(job);
    if (settings.spp < job.tiles.planned_samples()) {
      throw Error(ErrorKind::kUsage,
                  "job " + id.value + " has " + std::to_string(job.tiles.planned_samples()) +
                      " samples per pixel planned already; --spp is the new total and must not "
                      "be below");
    }
    const double now = impl_->clock.now();
    JobRecord record = impl_->record_at(job, now);
    record.settings = settings;
    record.target_met = job.last_estimate && meets_target(*job.last_estimate, settings.target_error);
    record.packets_done = count_packets(impl_->ledger(job), settings.spp);
    if (record.state == JobState::kDone) record.state = runnable_state(job);
    impl_->update(job, std::move(record), now);
  }
  impl_->settle_complete();
}

JobStatus Farm::wait(const JobId& id, uint64_t version, double timeout_s) const {
  // Real time, not the injected clock's: a simulated clock must not make anybody sleep.
  const auto end = std::chrono::steady_clock::now() +
                   std::chrono::duration<double>(std::clamp(timeout_s, 0.0, kMaxWaitSeconds));
  std::unique_lock lock(impl_->mutex);
  impl_->changed.wait_until(lock, end, [&] { return impl_->stopping || impl_->job(id).version > version; });
  return impl_->status(impl_->job(id), impl_->clock.now());
}

std::vector<WorkerStatus> Farm::workers() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->scheduler.workers.page({}, SIZE_MAX, impl_->clock.now()).workers;
}

WorkerPage Farm::workers(const WorkerId& after, size_t most) const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->scheduler.workers.page(after, most, impl_->clock.now());
}

FarmStats Farm::stats() const {
  const std::lock_guard lock(impl_->mutex);
  FarmStats stats = impl_->stats;
  stats.refusals["commit_stale"] = stats.commits_stale;
  stats.refusals["commit_corrupt"] = stats.commits_corrupt;
  stats.refusals["spot_check"] = stats.liars;
  stats.storage_fault = impl_->health.fault().has_value();
  stats.film_loads = impl_->merger.loads();
  stats.film_bytes = impl_->merger.bytes();
  return stats;
}

void Farm::stop_waiting() {
  const std::lock_guard lock(impl_->mutex);
  impl_->stopping = true;
  impl_->changed.notify_all();
  impl_->work.notify_all();
}

}  // namespace lightmill
