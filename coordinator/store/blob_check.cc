#include "coordinator/store/blob_check.h"

#include <map>
#include <optional>
#include <set>

#include "common/base/utf8.h"
#include "coordinator/store/blob_store.h"
#include "coordinator/store/job_store.h"

namespace lightmill {
namespace {

constexpr size_t kChunk = size_t{1} << 20, kMostName = 200;
constexpr const char* kMend = "; submit the scene again, or start a worker that has the file";

/// What jobs that have not ended need of the blobs.
class Needs {
 public:
  explicit Needs(JobStore& store) : store_(store) {}

  /// A problem with the job's files, or nothing.
  std::string add(const JobRecord& job, const std::set<std::string>& there) {
    try {
      const std::optional<std::string> text = store_.bundle_json(job.bundle_digest);
      if (!text) throw Error(ErrorKind::kFailed, "the list of its scene's files is gone");
      return problem_of(job, bundle_from_json(*text), there);
    } catch (const StoreError&) {
      throw;
    } catch (const Error& error) {
      return "job " + job.id.value + ": " + error.what() + "; cancel the job and submit it again";
    }
  }
  /// " (wood.png of job j3)"; empty: no job needs it.
  std::string user_of(const std::string& digest) const {
    const auto found = users_.find(digest);
    return found == users_.end() ? "" : " (" + found->second + ")";
  }

 private:
  std::string problem_of(const JobRecord& job, const Bundle& bundle, const std::set<std::string>& there) {
    size_t missing = 0;
    std::string first;
    for (const BundleEntry& entry : bundle.entries) {
      const std::string name = printable_line(entry.name, kMostName);
      users_.try_emplace(entry.digest, name + " of job " + job.id.value);
      if (there.contains(entry.digest)) continue;
      if (missing++ == 0) first = name + " (blob " + entry.digest + ")";
    }
    if (missing == 0) return "";
    const std::string others = missing > 1 ? " and " + std::to_string(missing - 1) + " other files" : "";
    return "job " + job.id.value + ": " + first + others + " of its scene missing" + kMend;
  }

  JobStore& store_;
  std::map<std::string, std::string> users_;
};

}  // namespace

std::vector<std::string> check_blobs(JobStore& store, BlobStore& blobs) {
  std::vector<std::string> problems;
  const std::vector<std::string> digests = blobs.digests();
  const std::set<std::string> there(digests.begin(), digests.end());
  Needs needs(store);
  for (const JobRecord& job : store.jobs()) {
    if (is_final(job.state)) continue;
    std::string problem = needs.add(job, there);
    if (!problem.empty()) problems.push_back(std::move(problem));
  }
  for (const std::string& digest : digests) {
    std::optional<BlobStore::Reader> blob = blobs.open(digest);
    if (!blob) continue;
    while (!blob->next(kChunk).empty()) continue;
    const std::string damage = blob->damage();
    if (!damage.empty()) problems.push_back(damage + needs.user_of(digest) + kMend);
  }
  return problems;
}

}  // namespace lightmill
