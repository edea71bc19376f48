#include "coordinator/core/repair/scene_files.h"

#include <set>

#include "common/base/log.h"
#include "coordinator/core/job_table.h"
#include "coordinator/core/leases.h"

namespace lightmill {

std::vector<std::string> SceneFiles::open_bundles() const {
  const std::lock_guard lock(farm_.mutex);
  std::set<std::string> digests;
  for (const JobId& id : farm_.scheduler.jobs.active())
    digests.insert(farm_.scheduler.jobs.find(id)->record.bundle_digest);
  return {digests.begin(), digests.end()};
}

std::string SceneFiles::bundle_of(const WorkerId& worker, const LeaseKey& lease) const {
  const std::lock_guard lock(farm_.mutex);
  const Job* job = farm_.scheduler.jobs.find(lease.job);
  return job && Leases::holds(*job, worker, lease) ? job->record.bundle_digest : "";
}

void SceneFiles::set_missing(const std::string& bundle_digest, const std::string& what, bool in_vain) {
  const std::lock_guard lock(farm_.mutex);
  for (Job* job : farm_.scheduler.jobs.active_jobs()) {
    if (job->record.bundle_digest == bundle_digest) set_missing(*job, what, in_vain);
  }
}

void SceneFiles::set_missing(Job& job, const std::string& what, bool in_vain) {
  const bool lacks = !what.empty() && (in_vain || job.lacks_file);
  if (job.missing_file == what && job.lacks_file == lacks) return;
  const LogScope scope({job.record.id.value, -1, 0, ""});
  const std::string name = "job " + job.record.id.value;
  if (what.empty()) {
    farm_.log(name + " has all files of its scene again" + (job.lacks_file ? " and goes on" : ""));
  } else {
    farm_.log(name + (lacks ? " pauses: " : ": ") + what);
  }
  if (lacks) JobTable::stop_clock(job, farm_.clock.now());
  job.missing_file = what;
  job.lacks_file = lacks;
  farm_.scheduler.state_changed(job);
  farm_.touch(job);
}

}  // namespace lightmill
