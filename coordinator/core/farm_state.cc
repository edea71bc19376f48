#include "coordinator/core/farm_state.h"

#include <chrono>
#include <utility>

#include "coordinator/store/guarded_job_store.h"

namespace lightmill {
namespace {

double unix_offset(const Clock& clock, const FarmOptions& options) {
  if (options.unix_offset) return *options.unix_offset;
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration<double>(now).count() - clock.now();
}

}  // namespace

FarmState::FarmState(std::unique_ptr<JobStore> job_store, const Clock& the_clock,
                     const FarmOptions& farm_options)
    : clock(the_clock),
      store(std::make_unique<GuardedJobStore>(std::move(job_store), health, the_clock)),
      options(farm_options),
      scheduler({farm_options.target_tile_seconds, farm_options.film_memory_bytes,
                 farm_options.ingest_bytes_per_second, farm_options.commits_per_second,
                 farm_options.max_workers, farm_options.lease_seconds, unix_offset(the_clock, farm_options)}),
      merger(*store, farm_options.film_memory_bytes, farm_options.spot_check > 0) {}

void FarmState::touch_quietly(Job& job) {
  job.version = ++version;
  if (Sequence* sequence = scheduler.jobs.sequence_of(job)) sequence->version = version;
  changed.notify_all();
}

void FarmState::touch(Job& job) {
  touch_quietly(job);
  work.notify_all();
}

void FarmState::log(const std::string& line) const {
  if (options.log) options.log(line);
}

void FarmState::keep_evidence(const LeaseKey& lease, const WorkerId& worker, const std::string& reason,
                              const std::string& bytes) const {
  try {
    if (options.quarantine) options.quarantine(lease, worker, reason, bytes);
  } catch (const Error& e) {  // evidence is good to have, no more
    log(e.what());
  }
}

std::string FarmState::new_id(const char* prefix, const char* kind) const {
  return prefix + std::to_string(store->next_number(kind));
}

}  // namespace lightmill
