#include "coordinator/farm/job_progress.h"

#include <algorithm>

namespace lightmill {
namespace {

constexpr double kRateWindowSeconds = 10;

}  // namespace

double wall_seconds(const Job& job, double now) {
  return job.record.wall_seconds + (job.running_since >= 0 ? std::max(0.0, now - job.running_since) : 0);
}

bool time_is_up(const Job& job, double now) {
  return job.record.settings.time_s > 0 && wall_seconds(job, now) >= job.record.settings.time_s;
}

void count_commit(RecentSamples& recent, double now, double pixel_samples) {
  recent.emplace_back(now, pixel_samples);
  while (recent.size() > 2 && recent.front().first < now - kRateWindowSeconds) recent.pop_front();
}

double recent_rate(const RecentSamples& recent, double now) {
  // The oldest entry of the window only marks its beginning: what it took to render lies before it.
  double samples = 0, first = -1;
  for (const auto& [time, count] : recent) {
    if (time < now - kRateWindowSeconds) continue;
    if (first < 0) {
      first = time;
    } else {
      samples += count;
    }
  }
  return first >= 0 && now > first ? samples / (now - first) : 0;
}

JobRecord with_partial(JobRecord record, const Partial& partial, const TileSpec& tile, size_t bytes) {
  record.quantum_exponent = partial.quantum_exponent;
  record.cpu_seconds += partial.cpu_seconds;
  record.packets_done += packets_completed(tile, record.settings.spp);
  ++record.tiles_committed;
  record.pixel_samples += record.settings.grid.pixels(tile.cells).area() * tile.samples();
  record.commit_bytes += bytes;
  record.counters += partial.counters;
  record.dropped.add(partial.dropped);
  return record;
}

JobRecord without_partials(JobRecord record) {
  record.quantum_exponent.reset();
  record.cpu_seconds = 0;
  record.packets_done = record.tiles_committed = record.pixel_samples = 0;
  record.commit_bytes = 0;
  record.counters = {};
  record.dropped = {};
  record.image_mean.reset();
  record.target_met = false;
  return record;
}

JobRecord with_totals_of(JobRecord record, const JobRecord& other) {
  record.quantum_exponent = other.quantum_exponent;
  record.cpu_seconds = other.cpu_seconds;
  record.packets_done = other.packets_done;
  record.tiles_committed = other.tiles_committed;
  record.pixel_samples = other.pixel_samples;
  record.commit_bytes = other.commit_bytes;
  record.counters = other.counters;
  record.dropped = other.dropped;
  record.image_mean = other.image_mean;
  record.target_met = other.target_met;
  return record;
}

double eta_seconds(const Job& job, double now) {
  const RenderSettings& settings = job.record.settings;
  if (is_final(job.record.state)) return 0;
  double eta = -1;
  const double rate = recent_rate(job.recent, now);
  if (rate > 1e-3) {
    const double total = static_cast<double>(settings.spp) * static_cast<double>(settings.grid.crop.area());
    eta = std::max(0.0, total - static_cast<double>(job.record.pixel_samples)) / rate;
  }
  if (settings.time_s > 0) {
    const double left = std::max(0.0, settings.time_s - wall_seconds(job, now));
    eta = eta < 0 ? left : std::min(eta, left);
  }
  return eta;
}

double seconds_left(const Job& job, double now) {
  const RenderSettings& settings = job.record.settings;
  const bool ends = settings.spp < kMaxSpp || settings.time_s > 0;
  const double eta = ends ? eta_seconds(job, now) : -1;
  const std::optional<double> high = target_estimate_high(job);
  if (!(settings.target_error > 0) || !high) return eta;
  const double left = std::max(0.0, wall_seconds(job, now) * (*high / settings.target_error - 1));
  return eta < 0 ? left : std::min(eta, left);
}

}  // namespace lightmill
