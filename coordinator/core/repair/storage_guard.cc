#include "coordinator/core/repair/storage_guard.h"

#include <utility>
#include <vector>

namespace lightmill {
namespace {

constexpr double kLookAgainSeconds = 5;

}  // namespace

void StorageGuard::require() const {
  if (const std::optional<std::string> fault = farm_.health.fault()) throw StoreError(*fault);
}

Merger::Open StorageGuard::open_layers(const JobId& id, const RenderSettings& settings) {
  try {
    return farm_.merger.open(id, settings);
  } catch (const StoreError&) {
    throw;  // the store as a whole, not this job
  } catch (const Error& error) {
    const std::lock_guard lock(farm_.mutex);
    const double now = farm_.clock.now();
    Job& damaged = jobs_.get(id);
    const bool final = is_final(damaged.record.state);
    if (damaged.fault.empty() && !final) farm_.log("job " + id.value + " pauses: " + error.what());
    damaged.fault = error.what();
    damaged.look_at = now + kLookAgainSeconds;
    JobTable::stop_clock(damaged, now);
    farm_.scheduler.state_changed(damaged);
    farm_.touch(damaged);
    if (!final) throw;
    throw Error(ErrorKind::kFailed,
                std::string(error.what()) + "; `lightmill retry " + id.value + "` renders it again");
  }
}

Merger::Open StorageGuard::open_layers(const JobId& id) {
  RenderSettings settings;
  {
    const std::lock_guard lock(farm_.mutex);
    settings = jobs_.get(id).record.settings;
  }
  return open_layers(id, settings);
}

void StorageGuard::look_again() {
  if (store_works()) look_at_damaged_jobs();
}

bool StorageGuard::store_works() {
  const std::optional<std::string> fault = farm_.health.fault();
  if (!fault) return true;
  {
    const std::lock_guard lock(farm_.mutex);
    const double now = farm_.clock.now();
    if (fault != logged_fault_) pause_all(*fault, now);
    if (!farm_.health.take_probe(now)) return false;
  }
  try {
    farm_.store->probe();
  } catch (const StoreError&) {
    return false;
  }
  farm_.health.mended();
  const std::lock_guard lock(farm_.mutex);
  logged_fault_.reset();
  farm_.log("the job store works again; jobs go on");
  for (const JobId& id : farm_.scheduler.jobs.active()) farm_.touch(jobs_.get(id));
  return true;
}

void StorageGuard::pause_all(const std::string& fault, double now) {
  farm_.log("all jobs pause: " + fault);
  logged_fault_ = fault;
  for (const JobId& id : farm_.scheduler.jobs.active()) {
    Job& job = jobs_.get(id);
    JobTable::stop_clock(job, now);
    farm_.touch(job);
  }
}

void StorageGuard::look_at_damaged_jobs() {
  std::vector<std::pair<JobId, RenderSettings>> damaged;
  {
    const std::lock_guard lock(farm_.mutex);
    const double now = farm_.clock.now();
    for (const JobId& id : farm_.scheduler.jobs.active()) {
      Job& active = jobs_.get(id);
      if (active.fault.empty() || now < active.look_at) continue;
      active.look_at = now + kLookAgainSeconds;
      damaged.emplace_back(id, active.record.settings);
    }
  }
  for (const auto& [id, settings] : damaged) {
    try {
      const Merger::Open layers = open_layers(id, settings);
      const std::lock_guard lock(farm_.mutex);
      Job& mended = jobs_.get(id);
      mended.fault.clear();
      mended.needs_repair = false;
      farm_.scheduler.state_changed(mended);
      farm_.log("job " + id.value + " can be read again and goes on");
      farm_.touch(mended);
    } catch (const DamagedLayers&) {  // still, and proven
      const std::lock_guard lock(farm_.mutex);
      jobs_.get(id).needs_repair = true;
    } catch (const Error&) {
      continue;  // its status says why
    }
  }
}

}  // namespace lightmill
