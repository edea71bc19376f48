#pragma once
// The coordinator's core: jobs, tiles, leases, the durable ledger and the merge, behind one thread-safe
// facade in domain types. gRPC services (services.cc) translate to it; `lightmill render` embeds it with a
// memory store, so that local and distributed renders go through the same merge code.
//
//   Farm farm(std::make_unique<MemoryJobStore>(), clock, {});
//   JobId job = farm.submit({...});
//   WorkerId w = farm.register_worker({...});
//   if (auto grant = farm.lease(w)) farm.commit(w, {grant->job, grant->tile_id, grant->attempt}, bytes);
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/error.h"
#include "common/base/ids.h"
#include "common/error/error_curve.h"
#include "common/film/film.h"
#include "common/job/pilot_report.h"
#include "common/farm/farm_types.h"
#include "common/scene/bundle.h"
#include "common/job/settings.h"

namespace lightmill {

class JobStore;  // job_store.h: SQLite (WAL) or memory

/// The coordinator does not know this job (services answer NOT_FOUND).
class UnknownJob : public Error {
 public:
  explicit UnknownJob(const JobId& id)
      : Error(ErrorKind::kFailed, "no job \"" + id.value + "\"; see `lightmill jobs`") {}
};
/// The coordinator does not know this worker, because it was restarted: it must register again.
class UnknownWorker : public Error {
 public:
  explicit UnknownWorker(const WorkerId& id)
      : Error(ErrorKind::kUnreachable, "worker \"" + id.value + "\" is not registered; register again") {}
};
/// A bound was met (too many jobs or workers).
class LimitReached : public Error {
 public:
  explicit LimitReached(const std::string& message) : Error(ErrorKind::kUnreachable, message) {}
};

struct FarmOptions {
  std::string build;  // a worker with another build is refused
  int schema = 0;
  double lease_seconds = 10;
  double target_tile_seconds = 1.0;
  int max_attempts = 5;                 // of a tile that workers report as failed
  size_t max_open_jobs = 10000;         // neither done, failed nor cancelled
  double checkpoint_bytes = 256e6;      // fold the spool into a film snapshot when it is larger
  double film_memory_bytes = 0x1p30;    // for the merged layers of jobs (film_bytes.h)
  double decode_memory_bytes = 0x1p29;  // for partials that are unpacked at once; a larger one is alone
  double ingest_bytes_per_second = 0;   // that tile sizes obey; 0: no limit
  double commits_per_second = 1000;     // that tile sizes obey, well below what one bears; 0: no limit
  size_t max_workers = 4096;            // registered and alive
  int spot_check = 0;  // one in so many committed tiles is rendered again by another worker; 0: none
  uint64_t spot_check_seed = 0;  // of the draw of these tiles; 0: one that no worker can foretell
  /// Receives one line about what an operator should know (refused partials, lost leases); may be empty.
  std::function<void(const std::string&)> log;
  /// Keeps a refused partial as evidence: (lease, worker, reason, bytes); may be empty. What it throws is
  /// logged.
  std::function<void(const LeaseKey&, const WorkerId&, const std::string&, const std::string&)> quarantine;
};

/// What happened since the start; for metrics.
struct FarmStats {
  uint64_t leases = 0;
  uint64_t leases_expired = 0;
  uint64_t commits = 0;
  uint64_t commits_repeated = 0;
  uint64_t commits_stale = 0;
  uint64_t commits_corrupt = 0;
  uint64_t commit_bytes = 0;
  uint64_t packets = 0;
  uint64_t failures = 0;
  uint64_t pixel_samples = 0;  // of accepted partials, as are the counters
  RenderCounters counters{};
  uint64_t races = 0;             // tiles given to a second worker while the first still had them
  uint64_t tiles_split = 0;       // so that more workers could share them
  uint64_t checks = 0;            // tiles rendered again to compare
  uint64_t liars = 0;             // workers whose pixels were wrong
  uint64_t tiles_taken_back = 0;  // of these workers
  /// What was refused, by reason: "worker_build", "worker_schema", "worker_limit", "job_limit",
  /// "commit_stale", "commit_corrupt", "commit_unknown_job", "spot_check".
  std::map<std::string, uint64_t> refusals;
  uint64_t film_loads = 0;     // merged layers that were read from the store
  double film_bytes = 0;       // taken by those in memory right now
  bool storage_fault = false;  // right now: jobs pause until the disk is mended
};

/// Some of all jobs, for views of the whole farm.
struct JobPage {
  std::vector<JobStatus> jobs;
  size_t total = 0;      // jobs that the farm knows
  uint64_t version = 0;  // of the newest change so far
};

/// The end of a job's ledger: the tiles of its last complete round and of all later ones.
struct TileMap {
  int64_t complete_samples = 0;             // every pixel has the samples below
  std::vector<TileStatus> tiles;            // ascending by id, without digests
  std::map<TileId, double> leased_seconds;  // of those that are leased, since the oldest lease
};

class Farm {
 public:
  using LeaseKey = lightmill::LeaseKey;

  Farm(std::unique_ptr<JobStore> store, const Clock& clock, const FarmOptions& options);
  ~Farm();

  // --- clients ---
  JobId submit(const JobRequest& request);
  /// Of all jobs in the order of submission [begin, begin + count); less where there are not as many.
  std::vector<JobStatus> jobs(size_t begin, size_t count) const;
  /// The newest 1000.
  std::vector<JobStatus> jobs() const;
  size_t job_count() const;
  /// Of the jobs [begin, begin + count) in the order of submission those that changed after `version`, that
  /// are being rendered or, with `waiting`, that have not ended. Pages keep the farm's lock short.
  JobPage page(size_t begin, size_t count, uint64_t version, bool waiting) const;
  /// The tiles that are leased now, with their workers.
  std::vector<std::pair<WorkerId, LeaseKey>> holdings() const;
  /// The following throw Error(kFailed, "no job ...") for an unknown job.
  JobStatus job(const JobId& id) const;
  std::vector<TileStatus> tiles(const JobId& id) const;
  /// Of a job of any length no more than a few rounds.
  TileMap tile_map(const JobId& id) const;
  ErrorCurve curve(const JobId& id) const;
  /// What the job's pilot estimated and chose; empty if it had none, or none yet.
  std::optional<PilotReport> pilot(const JobId& id) const;
  Image image(const JobId& id) const;
  /// Its AOVs, of the same samples as `image` (if given), which is filled; without channels if the job has
  /// none.
  ChannelImage aovs(const JobId& id, Image* image = nullptr) const;
  /// Where the noise is: BatchFilm::error_map of the job's batches.
  Image error_map(const JobId& id) const;
  Bundle bundle(const std::string& bundle_digest) const;
  void pause(const JobId& id);
  void resume(const JobId& id);
  void cancel(const JobId& id);
  void retry(const JobId& id);
  /// Of a job that has not ended; it counts from the next lease on.
  void set_priority(const JobId& id, int priority);
  /// New *totals*, in place of the old ones: without `spp` only the others stop the job.
  /// Reopens a finished job.
  void extend(const JobId& id, std::optional<int64_t> spp, std::optional<double> time_s,
              std::optional<double> target_error);
  /// Blocks until job(id).version > version or `timeout_s` passed; returns the newest status.
  JobStatus wait(const JobId& id, uint64_t version, double timeout_s) const;
  std::vector<WorkerStatus> workers() const;
  /// Some of them, see WorkerTable::page.
  WorkerPage workers(const WorkerId& after, size_t most) const;
  FarmStats stats() const;
  /// What an image file of the job should record: job, settings, samples, arithmetic class.
  std::map<std::string, std::string> image_metadata(const JobId& id) const;
  /// Largest encoded partial that a tile of this job can need, bytes; 0 for an unknown job or tile.
  uint64_t max_partial_bytes(const LeaseKey& lease) const;

  // --- workers ---
  /// Throws Error(kUnreachable) with a sentence if the build or schema does not fit, or no more may come.
  /// `owner`: whose token the worker came with, if any.
  WorkerId register_worker(const WorkerRegistration& registration, const std::string& owner = "");
  /// A worker was stopped at the door, before it could register: jobs that wait for one say why.
  void turned_away(const std::string& reason);
  /// Next tile for this worker, if any. Blocks up to `wait_s` for work. Throws Error(kUnreachable) for a
  /// worker that is not registered (after a restart): it registers again.
  std::optional<LeaseGrant> lease(const WorkerId& worker, double wait_s = 0);
  /// The same without waiting, for a thread that others need: what takes long, as the end of a job, is left
  /// to lease() and tick().
  std::optional<LeaseGrant> lease_at_once(const WorkerId& worker);
  /// Keeps the worker's leases alive; returns those (job, tile, attempt) that it has lost.
  std::vector<LeaseKey> renew(const WorkerId& worker, const std::vector<LeaseKey>& held);
  /// Takes an encoded partial, under a pilot's lease an encoded PilotResult, whose plan is then the job's.
  /// Durable once it returns kAccepted. A stale attempt is refused in the transaction that would merge it.
  /// `reason`, if given, receives why it was refused.
  CommitResult commit(const WorkerId& worker, const LeaseKey& lease, const std::string& partial_bytes,
                      std::string* reason = nullptr);
  /// The same but for the wait for the disk: kAccepted and kAlreadyCommitted must not leave this process
  /// before a flush() that was called later has returned.
  CommitResult commit_unflushed(const WorkerId& worker, const LeaseKey& lease,
                                const std::string& partial_bytes, std::string* reason = nullptr);
  /// Makes all durable that was committed before the call; calls at the same time share the work. Throws
  /// StoreError.
  void flush();
  /// The worker could not render the tile; leased again elsewhere, and after max_attempts the job fails.
  void fail(const WorkerId& worker, const LeaseKey& lease, const std::string& reason);
  /// What light the job's image will lack, as the worker found that holds the lease; a pilot's report brings
  /// its own. Throws Error(kUsage) for more than kMaxMissingLight lines, none, or one of more than
  /// kMaxNoteBytes.
  void warn(const WorkerId& worker, const LeaseKey& lease, const std::vector<std::string>& missing_light);
  /// The worker has no time for the tile any more; leased again at once, and nobody is blamed.
  void hand_back(const WorkerId& worker, const LeaseKey& lease);
  /// The worker takes no more leases; those it holds stay until committed or expired.
  void drain(const WorkerId& worker);
  /// Expires leases; called by a timer (and by lease()).
  void tick();
  /// Makes every waiting and later lease() and wait() return at once: the program is shutting down.
  void stop_waiting();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightmill
