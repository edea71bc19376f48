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

void count_commit(Job& job, double now, double pixel_samples) {
  job.recent.emplace_back(now, pixel_samples);
  while (job.recent.size() > 2 && job.recent.front().first < now - kRateWindowSeconds) job.recent.pop_front();
}

double recent_rate(const Job& job, double now) {
  // The oldest entry of the window only marks its beginning: what it took to render lies before it.
  double samples = 0, first = -1;
  for (const auto& [time, count] : job.recent) {
    if (time < now - kRateWindowSeconds) continue;
    if (first < 0) {
      first = time;
    } else {
      samples += count;
    }
  }
  return first >= 0 && now > first ? samples / (now - first) : 0;
}

double eta_seconds(const Job& job, double now) {
  const RenderSettings& settings = job.record.settings;
  if (is_final(job.record.state)) return 0;
  double eta = -1;
  const double rate = recent_rate(job, now);
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

}  // namespace lightmill
