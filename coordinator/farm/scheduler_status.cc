// What the scheduler can say of a job: its rate, when it will be done, and why nothing happens to it.
#include <algorithm>

#include "coordinator/farm/scheduler.h"

namespace lightmill {
namespace {

constexpr double kRateWindowSeconds = 10;

}  // namespace

void Scheduler::count_commit(Job& job, double now, double pixel_samples) {
  job.recent.emplace_back(now, pixel_samples);
  while (job.recent.size() > 2 && job.recent.front().first < now - kRateWindowSeconds) job.recent.pop_front();
}

double Scheduler::recent_rate(const Job& job, double now) {
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

double Scheduler::eta_seconds(const Job& job, double now) {
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

std::string Scheduler::note(const Job& job, double now) const {
  if (!is_runnable(job)) return {};
  if (const Job* earlier = waits_for(job)) {
    const JobState state = earlier->record.state;
    const std::string name = "job " + earlier->record.id.value;
    if (!is_final(state)) return "waits for " + name + ", which is " + job_state_name(state);
    return "blocked: it comes after " + name + ", which " +
           (state == JobState::kFailed ? "failed" : "was cancelled") + "; retry that one, or cancel this one";
  }
  for (const TileId& tile : job.checks.tiles()) {
    const std::vector<CheckTable::Vote>& votes = job.checks.votes(tile);
    if (votes.size() < 2) continue;
    return "workers " + votes[0].worker.value + " and " + votes[1].worker.value + " rendered tile " +
           std::to_string(tile.value) + " differently: a third one has to decide";
  }
  if (job.tiles.leased_count() > 0) return needs_pilot(job.record.settings) ? "choosing strategies" : "";
  int live = 0, pool = 0, present = 0, benched = 0;
  for (const auto& [id, worker] : workers.all()) {
    if (workers.is_lost(worker, now)) continue;
    ++present;
    benched += now < worker.benched_until;
    if (!workers.may_work(worker, now)) continue;
    ++live;
    if (job.record.pool.empty() || job.record.pool == worker.registration.pool) ++pool;
  }
  if (!job.checks.empty() && rendered(job, now)) return "waits for spot checks of its tiles";
  const std::string turned_away = workers.refusals(now);
  const std::string refused = turned_away.empty() ? "" : "; " + turned_away;
  if (live == 0 && benched > 0) {
    return "waits for a worker: of " + std::to_string(present) + " connected " + std::to_string(benched) +
           " rest after failures" + refused;
  }
  if (live == 0 && present > 0) return "waits for a worker: those connected are being drained" + refused;
  if (live == 0) return "waits for a worker: none is connected" + refused;
  if (pool == 0) return "waits for a worker of pool \"" + job.record.pool + "\"" + refused;
  if (fitting_workers(job, now, nullptr) == 0) {
    return "waits for a worker of arithmetic class " + job.record.arithmetic_class.substr(0, 12) +
           "; those connected compute other bits" + refused;
  }
  return {};
}

}  // namespace lightmill
