// What the farm does while its disk fails: jobs pause with the reason, nothing is leased or folded, and a
// tick looks whether it is mended.
#include "coordinator/core/farm_impl.h"

namespace lightmill {
namespace {

constexpr double kLookAgainSeconds = 5;

}  // namespace

void Farm::Impl::require_storage() const {
  if (const std::optional<std::string> fault = health.fault()) throw StoreError(*fault);
}

Merger::Open Farm::Impl::open_layers(const JobId& id, const RenderSettings& settings) {
  try {
    return merger.open(id, settings);
  } catch (const StoreError&) {
    throw;  // the store as a whole, not this job
  } catch (const Error& error) {
    const std::lock_guard lock(mutex);
    const double now = clock.now();
    Job& damaged = job(id);
    if (damaged.fault.empty()) log("job " + id.value + " pauses: " + error.what());
    damaged.fault = error.what();
    damaged.look_at = now + kLookAgainSeconds;
    stop_clock(damaged, now);
    touch(damaged);
    throw;
  }
}

void Farm::Impl::stop_clock(Job& job, double now) {
  job.record.wall_seconds = Scheduler::wall_seconds(job, now);
  job.running_since = -1;
}

void Farm::Impl::look_again() {
  if (const std::optional<std::string> fault = health.fault()) {
    {
      const std::lock_guard lock(mutex);
      const double now = clock.now();
      if (fault != logged_fault) {
        log("all jobs pause: " + *fault);
        logged_fault = fault;
        for (const JobId& id : scheduler.active()) {
          stop_clock(job(id), now);
          touch(job(id));
        }
      }
      if (!health.take_probe(now)) return;
    }
    try {
      store->probe();
    } catch (const StoreError&) {
      return;
    }
    health.mended();
    const std::lock_guard lock(mutex);
    logged_fault.reset();
    log("the job store works again; jobs go on");
    for (const JobId& id : scheduler.active()) touch(job(id));
  }

  std::vector<std::pair<JobId, RenderSettings>> damaged;
  {
    const std::lock_guard lock(mutex);
    const double now = clock.now();
    for (const JobId& id : scheduler.active()) {
      Job& active = job(id);
      if (active.fault.empty() || now < active.look_at) continue;
      active.look_at = now + kLookAgainSeconds;
      damaged.emplace_back(id, active.record.settings);
    }
  }
  for (const auto& [id, settings] : damaged) {
    try {
      const Merger::Open layers = open_layers(id, settings);
      const std::lock_guard lock(mutex);
      job(id).fault.clear();
      log("job " + id.value + " can be read again and goes on");
      touch(job(id));
    } catch (const Error&) {
      continue;  // its status says why
    }
  }
}

}  // namespace lightmill
