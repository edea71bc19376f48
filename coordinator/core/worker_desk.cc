#include "coordinator/core/worker_desk.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "coordinator/farm/farm_errors.h"

namespace lightmill {
namespace {

/// Somebody must look at expiries even where no timer calls tick().
constexpr std::chrono::seconds kLookAgain(1);

/// Why a worker may not come, and under which word that is counted.
struct Refusal {
  const char* kind = nullptr;  // null: it may
  std::string reason;
};

Refusal refusal_of(const WorkerRegistration& registration, const FarmOptions& options) {
  if (registration.build != options.build) {
    return {"worker_build", "worker of another build: it is \"" + printable(registration.build) +
                                "\", the coordinator is \"" + options.build +
                                "\"; install the same version on both"};
  }
  if (registration.schema != options.schema) {
    return {"worker_schema", "worker of another schema: it writes partials of schema " +
                                 std::to_string(registration.schema) + ", the coordinator reads " +
                                 std::to_string(options.schema) + "; install the same version on both"};
  }
  return {};
}

/// A worker that waits for a tile counts as seen.
class Polling {
 public:
  explicit Polling(Worker& worker) : worker_(worker) { ++worker_.polling; }
  ~Polling() { --worker_.polling; }
  Polling(const Polling&) = delete;
  Polling& operator=(const Polling&) = delete;

 private:
  Worker& worker_;
};

void check_missing_light(const std::vector<std::string>& lines) {
  if (lines.empty() || lines.size() > kMaxMissingLight)
    throw Error(ErrorKind::kUsage, "missing_light has 1 to " + std::to_string(kMaxMissingLight) + " lines");
  for (const std::string& line : lines) {
    if (line.empty() || line.size() > kMaxNoteBytes) {
      throw Error(ErrorKind::kUsage,
                  "a line of missing_light has 1 to " + std::to_string(kMaxNoteBytes) + " bytes");
    }
  }
}

void check_first_look(const Image& picture) {
  const auto is_side = [](int n) { return n >= 1 && n <= kMaxFirstLookSide; };
  if (!is_side(picture.width) || !is_side(picture.height)) {
    throw Error(ErrorKind::kUsage,
                "a first picture has 1 to " + std::to_string(kMaxFirstLookSide) + " pixels a side");
  }
  if (picture.channels != 3 ||
      picture.data.size() != 3 * static_cast<size_t>(picture.width) * static_cast<size_t>(picture.height))
    throw Error(ErrorKind::kUsage, "a first picture has three floats a pixel");
  for (const float x : picture.data) {
    if (!std::isfinite(x)) throw Error(ErrorKind::kUsage, "a first picture has finite values");
  }
}

}  // namespace

Worker& WorkerDesk::get(const WorkerId& id) {
  Worker* worker = farm_.scheduler.workers.find(id);
  if (!worker) throw UnknownWorker(id);
  return *worker;
}

WorkerId WorkerDesk::register_worker(const WorkerRegistration& registration, const std::string& owner) {
  const Refusal refusal = refusal_of(registration, farm_.options);
  if (!refusal.kind && registration.threads < 1)
    throw Error(ErrorKind::kUsage, "a worker needs at least one thread");
  // A thousand workers come at once when a coordinator is back. The disk must keep none of them waiting for
  // those before it, nor those who work: so this is outside of the lock.
  WorkerId id{farm_.new_id("w", "worker")};
  if (!refusal.kind) farm_.store->flush();
  const std::lock_guard lock(farm_.mutex);
  const double now = farm_.clock.now();
  if (refusal.kind) {
    ++farm_.stats.refusals[refusal.kind];
    farm_.scheduler.workers.add_refused(id, registration, refusal.reason, now);
    farm_.log("refused " + printable(registration.host) + ": " + refusal.reason);
    throw Error(ErrorKind::kUnreachable, refusal.reason);
  }
  try {
    farm_.scheduler.workers.add(id, registration, owner, now);
  } catch (const Error&) {
    ++farm_.stats.refusals["worker_limit"];
    throw;
  }
  farm_.work.notify_all();
  return id;
}

void WorkerDesk::turned_away(const std::string& reason) {
  const std::lock_guard lock(farm_.mutex);
  farm_.scheduler.workers.add_refused(WorkerId{"-"}, {}, reason, farm_.clock.now());
}

bool WorkerDesk::may_ask(Worker& worker, double now) {
  worker.last_seen = now;
  worker.asked = true;
  leases_.release_expired(now);
  return !farm_.stopping && !worker.draining;
}

std::optional<LeaseGrant> WorkerDesk::lease(const WorkerId& id, double wait_s) {
  using SteadyClock = std::chrono::steady_clock;
  // Real time, not the injected clock's: a simulated clock must not make anybody sleep.
  const auto end =
      SteadyClock::now() + std::chrono::duration_cast<SteadyClock::duration>(
                               std::chrono::duration<double>(std::clamp(wait_s, 0.0, kMaxWaitSeconds)));
  std::unique_lock lock(farm_.mutex);
  Worker& worker = get(id);
  const Polling polling(worker);  // a polling worker is never forgotten, so the reference stays good
  for (;;) {
    const double now = farm_.clock.now();
    if (!may_ask(worker, now)) return std::nullopt;
    if (!farm_.health.fault()) {
      if (std::optional<LeaseGrant> grant = leases_.grant(id, now)) return grant;
    }
    if (!ends_.complete_jobs(now).empty()) {
      lock.unlock();
      ends_.settle_complete();
      lock.lock();
      continue;
    }
    const auto real_now = SteadyClock::now();
    if (real_now >= end) return std::nullopt;
    farm_.work.wait_until(lock, std::min(end, real_now + kLookAgain));
  }
}

std::optional<LeaseGrant> WorkerDesk::lease_at_once(const WorkerId& id) {
  const std::lock_guard lock(farm_.mutex);
  Worker& worker = get(id);
  const double now = farm_.clock.now();
  if (!may_ask(worker, now) || farm_.health.fault()) return std::nullopt;
  return leases_.grant(id, now);
}

std::vector<LeaseKey> WorkerDesk::renew(const WorkerId& worker, const std::vector<LeaseKey>& held) {
  const std::lock_guard lock(farm_.mutex);
  get(worker);
  const double now = farm_.clock.now();
  farm_.scheduler.workers.seen(worker, now);
  leases_.release_expired(now);
  std::vector<LeaseKey> lost;
  for (const LeaseKey& key : held) {
    if (!leases_.renew(worker, key, now)) lost.push_back(key);
  }
  return lost;
}

Job* WorkerDesk::job_of(const WorkerId& worker, const LeaseKey& lease) {
  Job* job = farm_.scheduler.jobs.find(lease.job);
  return job && Leases::holds(*job, worker, lease) ? job : nullptr;
}

void WorkerDesk::fail(const WorkerId& worker, const LeaseKey& key, const std::string& reason,
                      FailureKind kind) {
  const std::lock_guard lock(farm_.mutex);
  const double now = farm_.clock.now();
  farm_.scheduler.workers.seen(worker, now);
  Job* job = job_of(worker, key);
  if (!job) return;
  ++farm_.stats.failures;
  if (kind == FailureKind::kTile) farm_.scheduler.workers.failed(worker, now);
  farm_.log("worker " + worker.value + " failed " +
            tile_name(key, is_pilot(job->tiles.find(key.tile)->tile)) + ": " + reason);
  if (kind == FailureKind::kScene) job->unable[worker] = kind;
  if (kind == FailureKind::kMemory) lacks_memory(*job, worker);
  leases_.release(worker, key, true, reason, now);
  if (is_final(job->record.state) || !job->unable.contains(worker)) return;
  if (!farm_.scheduler.is_believed(*job, key.tile, now)) return;
  const std::string why =
      kind == FailureKind::kScene
          ? "the scene can't be rendered (worker " + worker.value + "): "
          : "no worker here has enough memory for the scene; start one with more. Worker " + worker.value +
                ": ";
  jobs_.end(*job, JobState::kFailed, why + reason, now);
}

void WorkerDesk::lacks_memory(Job& job, const WorkerId& worker) {
  // The first time another scene may have been in the way.
  if (++job.memory_faults[worker] < 2) return;
  job.unable[worker] = FailureKind::kMemory;
  const Worker* reporter = farm_.scheduler.workers.find(worker);
  if (reporter && WorkerTable::is_proven(*reporter))
    job.least_memory = std::max(job.least_memory, reporter->registration.memory_bytes);
}

void WorkerDesk::warn(const WorkerId& worker, const LeaseKey& key,
                      const std::vector<std::string>& missing_light) {
  check_missing_light(missing_light);
  const std::lock_guard lock(farm_.mutex);
  const double now = farm_.clock.now();
  farm_.scheduler.workers.seen(worker, now);
  Job* job = job_of(worker, key);
  if (!job || job->record.missing_light == missing_light) return;
  JobRecord record = JobTable::record_at(*job, now);
  record.missing_light = missing_light;
  jobs_.update(*job, std::move(record), now);
}

void WorkerDesk::show(const WorkerId& worker, const LeaseKey& key, Image picture) {
  check_first_look(picture);
  const std::lock_guard lock(farm_.mutex);
  farm_.scheduler.workers.seen(worker, farm_.clock.now());
  Job* job = job_of(worker, key);
  if (!job || !is_pilot(job->tiles.find(key.tile)->tile)) return;
  farm_.first_looks.put(key.job, std::move(picture));
  farm_.touch_quietly(*job);
}

void WorkerDesk::hand_back(const WorkerId& worker, const LeaseKey& key) {
  const std::lock_guard lock(farm_.mutex);
  const double now = farm_.clock.now();
  farm_.scheduler.workers.seen(worker, now);
  if (job_of(worker, key)) farm_.scheduler.workers.handed_back(worker, now);
  leases_.release(worker, key, false, "", now);
}

bool WorkerDesk::is_proven(const WorkerId& worker) const {
  const std::lock_guard lock(farm_.mutex);
  const Worker* found = farm_.scheduler.workers.find(worker);
  return found && WorkerTable::is_proven(*found);
}

void WorkerDesk::drain(const WorkerId& worker) {
  const std::lock_guard lock(farm_.mutex);
  get(worker).draining = true;
  farm_.work.notify_all();
}

}  // namespace lightmill
