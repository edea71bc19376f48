#include "coordinator/core/pilots/pilot_commits.h"

#include <string>
#include <utility>

#include "common/base/digest.h"

namespace lightmill {

CommitResult PilotCommits::commit(const WorkerId& worker, const LeaseKey& lease, const PilotResult& result,
                                  size_t bytes) {
  const std::string report = pilot_to_json(result.report);
  const std::lock_guard lock(farm_.mutex);
  Job* job = farm_.scheduler.jobs.find(lease.job);
  if (!job || !job->tiles.holds(lease.tile, worker, lease.attempt)) {
    ++farm_.stats.commits_stale;
    return CommitResult::kStale;
  }
  const double now = farm_.clock.now();
  leases_.store_lease(*job, lease, now);
  const TileRecord committed = job->tiles.committed(lease.tile, lease.attempt, sha256_hex(report));
  JobRecord record = JobTable::record_at(*job, now);
  record.settings.plan = result.report.chosen;
  record.missing_light = result.report.missing_light;
  record.cpu_seconds += result.cpu_seconds;
  if (!farm_.store->commit_pilot(record, committed, report)) {
    ++farm_.stats.commits_stale;
    return CommitResult::kStale;
  }
  leases_.apply_commit(*job, std::move(record), committed, lease, result.cpu_seconds, now);
  farm_.stats.commit_bytes += bytes;
  farm_.touch(*job);  // there are tiles now
  return CommitResult::kAccepted;
}

}  // namespace lightmill
