#include "coordinator/core/round_ends.h"

#include <utility>

#include "common/error/metrics.h"
#include "common/job/aovs.h"
#include "common/job/replicates.h"
#include "coordinator/farm/job_progress.h"
#include "coordinator/farm/round_planner.h"

namespace lightmill {
namespace {

/// Fills in estimated and true errors.
void measure_errors(const Merger::Open& layers, ErrorPoint* point) {
  layers->batches.estimate(point);
  if (layers->reference.data.empty()) return;
  const Metrics metrics = compare_images(layers->film.resolve(), layers->reference);
  point->true_relmse = metrics.relmse;
  point->true_relmse_trimmed = metrics.relmse_trimmed;
  point->true_flip = metrics.flip;
  for (size_t i = 0; i < kBoxSides.size(); ++i) point->boxes[i].true_relmse = metrics.relmse_of_boxes[i];
}

}  // namespace

std::vector<JobId> RoundEnds::complete_jobs(double now) const {
  std::vector<JobId> ids;
  if (farm_.health.fault()) return ids;
  for (const Job* job : farm_.scheduler.jobs.in_work()) {
    if (job->fault.empty() && farm_.scheduler.complete(*job, now)) ids.push_back(job->record.id);
  }
  return ids;
}

void RoundEnds::settle(const JobId& id, Merger::Open& layers) {
  ErrorPoint point;
  const Due due = look(id, layers, &point);
  if (!due.anything) return;
  bool ended = false;
  try {
    if (due.new_point || due.denoised) measure_errors(layers, &point);
    std::optional<double> image_mean;
    if (due.image_mean) image_mean = layers->film.mean_magnitude();
    ended = apply(id, point, due.new_point, image_mean);
    if (due.denoised) denoiser_.add({id, point, layers->film.resolve(), layers->film.resolve_aovs()});
  } catch (...) {
    if (due.denoised) {
      const std::lock_guard lock(farm_.mutex);
      jobs_.get(id).denoising = false;  // it is tried again
    }
    throw;
  }
  const bool unfolded = layers->spool_bytes > 0 || farm_.options.spot_check > 0;  // or kept
  if (ended && unfolded) farm_.merger.checkpoint(id, layers, true);
}

RoundEnds::Due RoundEnds::look(const JobId& id, const Merger::Open& layers, ErrorPoint* point) {
  const std::lock_guard lock(farm_.mutex);
  Job& open = jobs_.get(id);
  if (is_final(open.record.state)) return {};
  open.batch_group = layers->batches.max_tile_superblocks();
  const double now = farm_.clock.now();
  if (!farm_.scheduler.complete(open, now) && !point_due(open)) return {};
  point->wall_seconds = wall_seconds(open, now);
  point->cpu_seconds = open.record.cpu_seconds;
  point->spp = static_cast<double>(open.record.pixel_samples) /
               static_cast<double>(open.record.settings.grid.crop.area());
  const bool denoised = wants_denoised_error(open, point->spp, farm_.scheduler.complete(open, now));
  if (denoised) open.denoising = true;
  return {true, !open.last_point || open.last_point->spp < point->spp, open.record.dropped.any(), denoised};
}

bool RoundEnds::wants_denoised_error(const Job& job, double spp, bool complete) const {
  const RenderSettings& settings = job.record.settings;
  const bool asks = (settings.target_denoised && settings.target_error > 0) || farm_.options.denoised_errors;
  if (!asks || (settings.aovs & kAovsToDenoise) != kAovsToDenoise || job.denoising ||
      spp < kIndependentHalvesSpp || settings.grid.crop.area() > kMaxDenoisedErrorPixels ||
      !denoiser_.has_room())
    return false;
  return awaits_denoised_error(job) || spp >= 2 * job.denoised_spp || (complete && spp > job.denoised_spp);
}

void RoundEnds::apply_denoised(const JobId& id, const ErrorPoint& point, const std::string& failure) {
  if (!failure.empty()) farm_.log("job " + id.value + ": its denoised image's error is unknown: " + failure);
  {
    const std::lock_guard lock(farm_.mutex);
    Job& job = jobs_.get(id);
    job.denoising = false;
    // Samples may have been taken back meanwhile, and the curve with them.
    if (!job.last_point || job.last_point->spp < point.spp) return;
    if (failure.empty()) {
      farm_.store->add_point(id, point);
      if (job.last_point->spp == point.spp) job.last_point = point;
      job.last_denoised = point;
    }
    job.denoised_spp = point.spp;
    const RenderSettings& settings = job.record.settings;
    if (settings.target_denoised && !is_final(job.record.state) &&
        meets_target(point, settings.target_error, true)) {
      const double now = farm_.clock.now();
      JobRecord record = JobTable::record_at(job, now);
      record.target_met = true;
      jobs_.update(job, std::move(record), now);
    }
    farm_.touch(job);  // its next round may begin
  }
  settle_complete();
}

void RoundEnds::look_at_waiting() {
  std::vector<JobId> ids;
  {
    const std::lock_guard lock(farm_.mutex);
    if (farm_.health.fault() || !denoiser_.has_room()) return;
    for (const Job* job : farm_.scheduler.jobs.in_work()) {
      if (job->fault.empty() && awaits_denoised_error(*job) && !job->denoising) ids.push_back(job->record.id);
    }
  }
  for (const JobId& id : ids) settle_one(id);
}

bool RoundEnds::apply(const JobId& id, const ErrorPoint& point, bool is_new,
                      std::optional<double> image_mean) {
  const std::lock_guard lock(farm_.mutex);
  Job& open = jobs_.get(id);
  if (is_final(open.record.state)) return false;
  const double now = farm_.clock.now();
  if (image_mean) open.record.image_mean = image_mean;
  if (is_new) {
    farm_.store->add_point(id, point);
    open.last_point = point;
    if (point.relmse) open.last_estimate = point;
    const RenderSettings& settings = open.record.settings;
    if (!settings.target_denoised && meets_target(point, settings.target_error)) {
      JobRecord record = JobTable::record_at(open, now);
      record.target_met = true;
      jobs_.update(open, std::move(record), now);
    }
  }
  const bool complete = farm_.scheduler.complete(open, now);
  if (complete) {
    jobs_.end(open, JobState::kDone, "", now);
  } else {
    farm_.touch(open);
  }
  return complete;
}

void RoundEnds::settle_complete() {
  std::vector<JobId> ids;
  {
    const std::lock_guard lock(farm_.mutex);
    ids = complete_jobs(farm_.clock.now());
  }
  for (const JobId& id : ids) settle_one(id);
}

void RoundEnds::settle_one(const JobId& id) {
  try {
    Merger::Open layers = storage_.open_layers(id);
    settle(id, layers);
  } catch (const Error& error) {  // its disk; other jobs go on, and a later tick tries again
    farm_.log("job " + id.value + ": " + error.what());
  }
}

}  // namespace lightmill
