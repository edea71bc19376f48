#include "coordinator/core/job_desk.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "common/base/utf8.h"
#include "common/error/metrics.h"
#include "coordinator/farm/farm_errors.h"

namespace lightmill {
namespace {

constexpr size_t kMaxJobs = 100000;
constexpr size_t kMaxAfter = 1000;
constexpr int kMaxMaxWorkers = 100000;

/// "job j1 is done; only a job that is running can be paused"
Error wrong_state(const JobRecord& job, const char* wanted, const char* verb) {
  return {ErrorKind::kFailed, "job " + job.id.value + " is " + job_state_name(job.state) +
                                  "; only a job that is " + wanted + " can be " + verb};
}

/// The image is one that renders can be compared with, or none.
void check_reference(const Image& reference, const PixelRect& crop) {
  if (reference.data.empty()) return;
  if (reference.width != crop.width() || reference.height != crop.height() || reference.channels != 3) {
    throw Error(ErrorKind::kUsage, "the reference image is " + std::to_string(reference.width) + "x" +
                                       std::to_string(reference.height) + ", the job renders " +
                                       std::to_string(crop.width()) + "x" + std::to_string(crop.height()) +
                                       "; give one of the same size");
  }
  check_comparable(reference, "reference");
}

/// Throws Error(kUsage) if the request is out of range; whether jobs that it names exist is another question.
void check_request(const JobRequest& request, const RenderSettings& settings) {
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
  check_reference(request.reference, settings.grid.crop);
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

JobId JobDesk::submit(const JobRequest& request) {
  RenderSettings settings = settings_from_json(settings_to_json(request.settings));  // checks the ranges
  settings.grid.interleaved = true;  // whatever the client knows of it: only jobs of older versions are not
  check_request(request, settings);
  Job job;
  // Names are shown in terminals, pages and files, wherever they came from.
  job.record.name = printable_line(request.name, kMaxNameBytes);
  job.record.bundle_digest = request.bundle.digest();
  job.record.settings = settings;
  job.record.priority = request.priority;
  job.record.pool = printable_line(request.pool, kMaxNameBytes);
  job.record.submitter = printable_line(request.submitter, kMaxNameBytes);
  job.record.max_workers = request.max_workers;
  job.record.after = request.after;
  const std::string bundle_json = bundle_to_json(request.bundle);

  const std::lock_guard lock(farm_.mutex);
  for (const JobId& id : request.after) jobs_.get(id);  // throws UnknownJob
  require_room();
  job.record.id = JobId{farm_.new_id("j", "job")};
  farm_.store->add_job(job.record, bundle_json, request.reference);
  farm_.touch(farm_.scheduler.add(std::move(job)));
  return farm_.scheduler.order().back();
}

void JobDesk::require_room() {
  const size_t most_open = farm_.options.max_open_jobs;
  std::string refusal;
  if (farm_.scheduler.order().size() >= kMaxJobs) {
    refusal = "the coordinator has its limit of " + std::to_string(kMaxJobs) +
              " jobs; start one with a new data folder";
  } else if (farm_.scheduler.active().size() >= most_open) {
    refusal = "there are " + std::to_string(most_open) +
              " jobs that have not ended (the coordinator's --max-open-jobs); wait, or cancel some";
  }
  if (refusal.empty()) return;
  ++farm_.stats.refusals["job_limit"];
  throw LimitReached(refusal);
}

void JobDesk::pause(const JobId& id) {
  const std::lock_guard lock(farm_.mutex);
  Job& job = jobs_.get(id);
  if (job.record.state != JobState::kQueued && job.record.state != JobState::kRunning) {
    throw wrong_state(job.record, "queued or running", "paused");
  }
  const double now = farm_.clock.now();
  JobRecord record = JobTable::record_at(job, now);
  record.state = JobState::kPaused;
  jobs_.update(job, std::move(record), now);
  job.running_since = -1;
}

void JobDesk::resume(const JobId& id) {
  const std::lock_guard lock(farm_.mutex);
  Job& job = jobs_.get(id);
  if (job.record.state != JobState::kPaused) throw wrong_state(job.record, "paused", "resumed");
  JobRecord record = job.record;
  record.state = runnable_state(job);
  jobs_.update(job, std::move(record), farm_.clock.now());
}

void JobDesk::cancel(const JobId& id) {
  const std::lock_guard lock(farm_.mutex);
  Job& job = jobs_.get(id);
  if (is_final(job.record.state)) throw wrong_state(job.record, "queued, running or paused", "cancelled");
  jobs_.end(job, JobState::kCancelled, "cancelled by a client", farm_.clock.now());
}

void JobDesk::retry(const JobId& id) {
  const std::lock_guard lock(farm_.mutex);
  Job& job = jobs_.get(id);
  const bool unreadable = job.record.state == JobState::kDone && !job.fault.empty();
  if (job.record.state != JobState::kFailed && job.record.state != JobState::kCancelled && !unreadable) {
    throw wrong_state(job.record, "failed or cancelled", "retried");
  }
  jobs_.load_ledger(job);
  const double now = farm_.clock.now();
  forgive_tiles(job);
  JobRecord record = job.record;
  record.state = runnable_state(job);
  record.message.clear();
  jobs_.update(job, std::move(record), now);
}

void JobDesk::forgive_tiles(Job& job) {
  std::vector<TileRecord> forgiven;
  for (const TileRecord& tile : job.tiles.tiles()) {
    if (tile.failures == 0) continue;
    forgiven.push_back(tile);
    forgiven.back().failures = 0;
  }
  for (const TileRecord& tile : forgiven) {
    farm_.store->save_tile(job.record, tile);
    job.tiles.apply(tile);
  }
  job.failures_in_row = 0;
}

void JobDesk::set_priority(const JobId& id, int priority) {
  const std::lock_guard lock(farm_.mutex);
  Job& job = jobs_.get(id);
  if (is_final(job.record.state)) {
    throw Error(ErrorKind::kFailed, "job " + id.value + " is " + job_state_name(job.record.state) +
                                        "; priority matters to jobs that have not ended");
  }
  const double now = farm_.clock.now();
  JobRecord record = JobTable::record_at(job, now);
  record.priority = priority;
  farm_.scheduler.withdraw(job);
  jobs_.update(job, std::move(record), now);
}

void JobDesk::extend(const JobId& id, std::optional<int64_t> spp, std::optional<double> time_s,
                     std::optional<double> target_error) {
  {
    const std::lock_guard lock(farm_.mutex);
    Job& job = jobs_.get(id);
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
    apply_settings(job, settings_from_json(settings_to_json(settings)));  // checks the ranges
  }
  ends_.settle_complete();
}

void JobDesk::apply_settings(Job& job, const RenderSettings& settings) {
  jobs_.load_ledger(job);
  if (settings.spp < job.tiles.planned_samples()) {
    throw Error(ErrorKind::kUsage,
                "job " + job.record.id.value + " has " + std::to_string(job.tiles.planned_samples()) +
                    " samples per pixel planned already; --spp is the new total and must not "
                    "be below");
  }
  const double now = farm_.clock.now();
  JobRecord record = JobTable::record_at(job, now);
  record.settings = settings;
  record.target_met = job.last_estimate && meets_target(*job.last_estimate, settings.target_error);
  record.packets_done = count_packets(jobs_.ledger(job), settings.spp);
  if (record.state == JobState::kDone) record.state = runnable_state(job);
  jobs_.update(job, std::move(record), now);
}

}  // namespace lightmill
