// The pilot's commit: what it chose becomes part of the job's settings, for good.
#include "common/base/digest.h"
#include "coordinator/core/farm_impl.h"

namespace lightmill {

CommitResult Farm::Impl::commit_pilot(const WorkerId& worker, const LeaseKey& lease,
                                      const std::string& bytes) {
  PilotResult result;
  try {
    result = decode_pilot(bytes);
  } catch (const Error& e) {
    return refuse(worker, lease, e.what(), bytes);
  }
  {
    const std::string report = pilot_to_json(result.report);
    const std::lock_guard lock(mutex);
    Job* owner = scheduler.find(lease.job);
    if (!owner || !owner->tiles.holds(lease.tile, worker, lease.attempt)) {
      ++stats.commits_stale;
      return CommitResult::kStale;
    }
    const double now = clock.now();
    const TileRecord committed = owner->tiles.committed(lease.tile, lease.attempt, sha256_hex(report));
    JobRecord record = record_at(*owner, now);
    record.settings.plan = result.report.chosen;
    record.missing_light = result.report.missing_light;
    record.cpu_seconds += result.cpu_seconds;
    if (!store->commit_pilot(record, committed, report)) {
      ++stats.commits_stale;
      return CommitResult::kStale;
    }
    apply_commit(*owner, std::move(record), committed, lease, result.cpu_seconds, now);
    stats.commit_bytes += bytes.size();
    touch(*owner);  // there are tiles now
  }
  return CommitResult::kAccepted;
}

std::optional<PilotReport> Farm::pilot(const JobId& id) const {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->job(id);  // throws for an unknown one
  }
  const std::string report = impl_->store->pilot(id);
  if (report.empty()) return std::nullopt;
  return pilot_from_json(report);
}

}  // namespace lightmill
