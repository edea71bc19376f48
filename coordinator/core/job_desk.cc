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
constexpr double kLastDeadline = 1e12;

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
  if (!(request.deadline >= 0 && request.deadline <= kLastDeadline)) {
    throw Error(ErrorKind::kUsage, "a deadline is a time in seconds since 1970, or 0 for none");
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

JobRecord JobDesk::record_of(const JobRequest& request) {
  RenderSettings settings = settings_from_json(settings_to_json(request.settings));  // checks the ranges
  settings.grid.interleaved = true;  // whatever the client knows of it: only jobs of older versions are not
  check_request(request, settings);
  JobRecord record;
  // Names are shown in terminals, pages and files, wherever they came from.
  record.name = printable_line(request.name, kMaxNameBytes);
  record.bundle_digest = request.bundle.digest();
  record.settings = settings;
  record.priority = request.priority;
  record.pool = printable_line(request.pool, kMaxNameBytes);
  record.submitter = printable_line(request.submitter, kMaxNameBytes);
  record.max_workers = request.max_workers;
  record.deadline = request.deadline;
  record.after = request.after;
  return record;
}

JobId JobDesk::submit(const JobRequest& request) {
  Job job;
  job.record = record_of(request);
  const std::string bundle_json = bundle_to_json(request.bundle);

  const std::lock_guard lock(farm_.mutex);
  require_known(request.after);
  require_room(1, 1);
  job.record.id = JobId{farm_.new_id("j", "job")};
  farm_.store->add_job(job.record, bundle_json, request.reference);
  farm_.touch(farm_.scheduler.add(std::move(job)));
  return farm_.scheduler.jobs.order().back();
}

void JobDesk::require_known(const std::vector<JobId>& earlier) {
  for (const JobId& id : earlier) {
    if (!farm_.scheduler.jobs.find(SequenceId{id.value})) jobs_.get(id);
  }
}

void JobDesk::require_room(size_t jobs, size_t open) {
  const size_t most_open = farm_.options.max_open_jobs;
  std::string refusal;
  if (farm_.scheduler.jobs.order().size() + jobs > kMaxJobs) {
    refusal = "the coordinator has its limit of " + std::to_string(kMaxJobs) +
              " jobs; start one with a new data folder";
  } else if (farm_.scheduler.jobs.open_count() + open > most_open) {
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
  const double now = farm_.clock.now();
  std::optional<JobRecord> record = paused(job, now);
  if (!record) throw wrong_state(job.record, "queued or running", "paused");
  jobs_.update(job, std::move(*record), now);
}

std::optional<JobRecord> JobDesk::paused(const Job& job, double now) {
  if (job.record.state != JobState::kQueued && job.record.state != JobState::kRunning) return std::nullopt;
  JobRecord record = JobTable::record_at(job, now);
  record.state = JobState::kPaused;
  return record;
}

void JobDesk::resume(const JobId& id) {
  const std::lock_guard lock(farm_.mutex);
  Job& job = jobs_.get(id);
  std::optional<JobRecord> record = resumed(job);
  if (!record) throw wrong_state(job.record, "paused", "resumed");
  jobs_.update(job, std::move(*record), farm_.clock.now());
}

std::optional<JobRecord> JobDesk::resumed(const Job& job) {
  if (job.record.state != JobState::kPaused) return std::nullopt;
  JobRecord record = job.record;
  record.state = runnable_state(job);
  return record;
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
  std::optional<JobRecord> record = retried(job);
  if (!record) throw wrong_state(job.record, "failed or cancelled", "retried");
  jobs_.update(job, std::move(*record), farm_.clock.now());
}

std::optional<JobRecord> JobDesk::retried(Job& job) {
  const bool unreadable = job.record.state == JobState::kDone && !job.fault.empty();
  if (job.record.state != JobState::kFailed && job.record.state != JobState::kCancelled && !unreadable)
    return std::nullopt;
  jobs_.load_ledger(job);
  forgive_tiles(job);
  JobRecord record = job.record;
  record.state = runnable_state(job);
  record.message.clear();
  return record;
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
  if (job.record.frame) {
    throw Error(ErrorKind::kUsage, "job " + id.value + " is a frame; set the priority of sequence " +
                                       job.record.frame->sequence.value);
  }
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
    const double now = farm_.clock.now();
    const RenderSettings settings = with_totals(job.record.settings, spp, time_s, target_error);
    jobs_.update(job, extended(job, settings, now), now);
  }
  ends_.settle_complete();
}

RenderSettings JobDesk::with_totals(RenderSettings settings, std::optional<int64_t> spp,
                                    std::optional<double> time_s, std::optional<double> target_error) {
  if ((spp && *spp < 1) || (time_s && !(*time_s >= 0)) || (target_error && !(*target_error >= 0))) {
    throw Error(ErrorKind::kUsage,
                "extend: samples must be at least 1, a time and a target error at least 0");
  }
  if (spp || time_s || target_error) {
    // The new totals replace the old ones: a job that had run out of time goes on to the samples asked for.
    settings.spp = spp.value_or(kMaxSpp);
    settings.time_s = time_s.value_or(0);
    settings.target_error = target_error.value_or(0);
  }
  return settings_from_json(settings_to_json(settings));  // checks the ranges
}

JobRecord JobDesk::extended(Job& job, const RenderSettings& settings, double now) {
  jobs_.load_ledger(job);
  if (settings.spp < job.tiles.planned_samples()) {
    throw Error(ErrorKind::kUsage,
                "job " + job.record.id.value + " has " + std::to_string(job.tiles.planned_samples()) +
                    " samples per pixel planned already; --spp is the new total and must not "
                    "be below");
  }
  JobRecord record = JobTable::record_at(job, now);
  record.settings = settings;
  const std::optional<ErrorPoint>& last = target_estimate(job);
  record.target_met = last && meets_target(*last, settings.target_error, settings.target_denoised);
  record.packets_done = count_packets(jobs_.ledger(job), settings.spp);
  if (record.state == JobState::kDone) record.state = runnable_state(job);
  return record;
}

}  // namespace lightmill
