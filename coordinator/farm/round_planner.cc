#include "coordinator/farm/round_planner.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/error/checkpoints.h"
#include "common/error/error_estimate.h"
#include "coordinator/farm/job_progress.h"
#include "coordinator/farm/sharing/film_bytes.h"

namespace lightmill {
namespace {

constexpr double kDeepest = 1024;  // superblocks of a round
// Where splats have to be spared a tile is deep rather than wide: it has so small a part of the window at
// most, so that its camera layer weighs little beside its splats.
constexpr double kSplatTilesOfWindow = 4;
constexpr double kUsualSpeed = 2e5;         // samples a second, of a worker that has not shown its own yet
constexpr double kHeavySplatBytes = 200e3;  // a smaller layer costs no more than a lease does
constexpr double kPointSpacing = 1.25;      // points of the curve are this far apart in spp
constexpr int64_t kMinSamplesForTarget = int64_t{kMinIntervalBatches} * kSuperblockSamples;

/// Whether so many samples are one of the checkpoints of the job's target error.
bool is_checkpoint(const RenderSettings& settings, int64_t samples) {
  return samples > 0 && (settings.target_denoised ? next_denoised_checkpoint(samples - 1)
                                                  : next_checkpoint(samples - 1)) == samples;
}

/// True while what is planned ends at a checkpoint that may turn out to meet the target error.
bool awaits_checkpoint(const Job& job) {
  const double target = job.record.settings.target_error;
  const int64_t samples = job.tiles.planned_samples();
  if (!(target > 0) || !is_checkpoint(job.record.settings, samples)) return false;
  // The last word on a denoised image comes late, so the next samples always wait for it.
  if (job.record.settings.target_denoised) return job.denoised_spp < static_cast<double>(samples);
  if (samples < kMinSamplesForTarget) return false;
  const auto planned = static_cast<double>(samples);
  if (job.last_point && job.last_point->spp >= planned) return false;  // looked at
  // Error falls as 1/samples. Where even the lower end of the interval stays above the target there is no
  // need to wait; before the first interval there is nothing to go by.
  const auto& last = job.last_estimate;
  return !last || !last->relmse_low || *last->relmse_low * last->spp / planned <= target;
}

}  // namespace

int fitting_workers(const WorkerTable& workers, const Job& job, double now, double* mean_speed) {
  int count = 0, measured = 0;
  double speed = 0;
  for (const auto& [id, worker] : workers.all()) {
    if (!workers.may_work(worker, now) || !fits(job, worker)) continue;
    ++count;
    if (worker.samples_per_second > 0) {
      ++measured;
      speed += worker.samples_per_second;
    }
  }
  if (mean_speed) *mean_speed = measured > 0 ? speed / measured : 0;
  return count;
}

bool is_planned_out(const Job& job, double now) {
  const int64_t planned = job.tiles.planned_samples();
  if (planned >= job.record.settings.spp || job.record.target_met) return true;
  // A first picture is owed even to a job whose pilot took all its time.
  if (planned > 0 && time_is_up(job, now)) return true;
  // More samples than the target asks for are lost time: rather the workers pause until the round is in.
  return awaits_checkpoint(job);
}

bool awaits_denoised_error(const Job& job) {
  const RenderSettings& settings = job.record.settings;
  const int64_t complete = job.tiles.complete_samples();
  return settings.target_denoised && settings.target_error > 0 && !job.record.target_met &&
         is_checkpoint(settings, complete) && job.denoised_spp < static_cast<double>(complete);
}

bool point_due(const Job& job) {
  const int64_t complete = job.tiles.complete_samples();
  if (complete <= 0) return false;
  if (awaits_denoised_error(job) && !job.denoising) return true;
  if (job.record.settings.target_error > 0 && !job.record.settings.target_denoised) {
    const double looked_at = job.last_point ? job.last_point->spp : 0;
    return static_cast<double>(complete) > looked_at && next_checkpoint(complete - 1) == complete;
  }
  return !job.last_point || static_cast<double>(complete) >= job.last_point->spp * kPointSpacing;
}

std::vector<TileSpec> RoundPlanner::next_round(const Job& job, double now) const {
  const RenderSettings& settings = job.record.settings;
  if (needs_pilot(settings))
    return job.tiles.next_id() == 0 ? std::vector{TileSpec{}} : std::vector<TileSpec>{};
  TilingInput input;
  input.grid = settings.grid;
  input.begin = job.tiles.planned_samples();
  input.spp = settings.spp;
  if (is_planned_out(job, now)) return {};
  input.workers = fitting_workers(workers_, job, now, &input.worker_samples_per_second);
  if (job.record.max_workers > 0) input.workers = std::min(input.workers, job.record.max_workers);
  // Speeds were measured on other jobs too; a new job starts small whatever they say.
  input.target_tile_seconds = options_.target_tile_seconds;
  if (options_.commits_per_second > 0) {
    const auto all = static_cast<double>(workers_.all().size());
    input.target_tile_seconds = std::max(input.target_tile_seconds, all / options_.commits_per_second);
  }
  if (!job.tiles.rounds().empty()) {
    const LeaseTable::Round& last = job.tiles.rounds().back();
    input.previous_tile_samples = std::max<int64_t>(
        1, settings.grid.crop.area() * (last.end - last.begin) / std::max<int64_t>(1, last.tiles));
  }
  input.max_superblocks = job.batch_group;
  input.splats = splat_layer_bytes(settings) >= kHeavySplatBytes;
  input.halves = settings.aovs & kAovDifference;
  input.to_checkpoint = settings.target_error > 0;
  input.denoised_checkpoint = settings.target_denoised;
  obey_ingest(job, &input);
  if (settings.time_s > 0) input.seconds_left = std::max(0.0, settings.time_s - wall_seconds(job, now));
  return plan_round(input);
}

void RoundPlanner::obey_ingest(const Job& job, TilingInput* input) const {
  if (!(options_.ingest_bytes_per_second > 0)) return;
  double depth = 0;  // samples per pixel
  if (input->splats) {
    const auto window = static_cast<double>(input->grid.crop.area());
    const double speed =
        input->worker_samples_per_second > 0 ? input->worker_samples_per_second : kUsualSpeed;
    const double commit_seconds = splat_layer_bytes(job.record.settings) / options_.ingest_bytes_per_second;
    // n workers render what is left in left / n seconds, and hand in a layer each, one after the other.
    const double left = window * static_cast<double>(input->spp - input->begin) / speed;
    const double enough = std::clamp(std::sqrt(left / commit_seconds), 1.0, 1e6);
    input->workers = std::min(input->workers, static_cast<int>(enough));
    const double samples = input->workers * speed * commit_seconds;
    input->min_tile_samples = static_cast<int64_t>(std::clamp(samples, 0.0, 0x1p50));
    depth = kSplatTilesOfWindow * samples / window;
  } else if (job.commit_pixels > 0) {
    const double samples_per_second = input->workers * input->worker_samples_per_second;
    depth = samples_per_second * job.commit_bytes / job.commit_pixels / options_.ingest_bytes_per_second;
  }
  const double wanted = std::clamp(std::ceil(depth / static_cast<double>(kSuperblockSamples)), 1.0, kDeepest);
  input->min_superblocks = static_cast<int64_t>(std::bit_ceil(static_cast<uint64_t>(wanted)));
}

}  // namespace lightmill
