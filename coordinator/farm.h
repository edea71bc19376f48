#pragma once
// The coordinator's core: jobs, tiles, leases, the durable ledger and the merge, behind one thread-safe
// facade in domain types. gRPC services (services.cc) translate to it; `lightmill render` embeds it with a
// memory store, so that local and distributed renders go through the same merge code.
//
//   Farm farm(std::make_unique<MemoryJobStore>(), clock, {});
//   JobId job = farm.submit({...});
//   WorkerId w = farm.register_worker({...});
//   if (auto grant = farm.lease(w)) farm.commit(w, grant->job, grant->tile_id, grant->attempt, bytes);
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/clock.h"
#include "common/error.h"
#include "common/ids.h"
#include "common/image/error_curve.h"
#include "common/image/film.h"
#include "common/scene/bundle.h"
#include "common/settings.h"

namespace lightmill {

class JobStore;  // job_store.h: SQLite (WAL) or memory

enum class JobState { kQueued, kRunning, kPaused, kDone, kFailed, kCancelled };
const char* job_state_name(JobState state);

struct JobRequest {
  std::string name;
  Bundle bundle;
  RenderSettings settings;
  int priority = 0;       // higher first
  std::string pool;       // empty: any worker
  Image reference;        // empty, or what --reference gave: adds the true errors to the curve
};

struct JobStatus {
  JobId id;
  std::string name;
  JobState state = JobState::kQueued;
  std::string message;  // why it failed or waits
  RenderSettings settings;
  std::string bundle_digest;
  int priority = 0;
  std::string pool;
  int64_t packets_done = 0, packets_total = 0;
  int64_t tiles_committed = 0, tiles_leased = 0;
  int64_t leases_reassigned = 0;  // attempts above the first
  double spp = 0;                 // mean samples per pixel folded so far
  double wall_seconds = 0;        // render wall time: without pauses and waiting for the first worker
  double cpu_seconds = 0;         // of the workers, from the partials
  double samples_per_second = 0;  // recent
  double eta_seconds = -1;        // -1: unknown
  std::optional<double> relmse, relmse_low, relmse_high;  // last point of the curve
  RenderCounters counters;
  int workers = 0;       // with a lease on this job
  uint64_t version = 0;  // grows with every change
};

struct TileStatus {
  TileId id;
  TileSpec tile;
  std::string state;  // "pending", "leased", "committed"
  int64_t attempt = 0;
  WorkerId worker;
  std::string digest;  // of the committed partial
};

struct WorkerRegistration {
  std::string host;
  int threads = 1;
  std::string build;             // build id: program + library versions
  int schema = 0;                // of the partial's encoding
  std::string arithmetic_class;  // digest of the built-in render
  std::string pool;
};

struct WorkerStatus {
  WorkerId id;
  WorkerRegistration registration;
  std::string state;  // "idle", "rendering", "draining", "lost", "refused"
  int64_t tiles_committed = 0;
  double samples_per_second = 0;
  double seconds_since_seen = 0;
};

/// What a worker needs to render a tile. `attempt` is the lease's token: monotonic per tile.
struct LeaseGrant {
  JobId job;
  TileId tile_id;
  int64_t attempt = 0;
  TileSpec tile;
  RenderSettings settings;
  std::string bundle_digest;
  double lease_seconds = 10;
};

enum class CommitResult { kAccepted, kAlreadyCommitted, kStale, kCorrupt, kUnknownJob };

struct FarmOptions {
  std::string build;              // a worker with another build is refused
  int schema = 0;
  double lease_seconds = 10;
  double target_tile_seconds = 1.0;
  int max_attempts = 5;           // of a tile that workers report as failed
  double checkpoint_bytes = 256e6;  // fold the spool into a film snapshot when it is larger
};

class Farm {
 public:
  Farm(std::unique_ptr<JobStore> store, const Clock& clock, const FarmOptions& options);
  ~Farm();

  // --- clients ---
  JobId submit(const JobRequest& request);
  std::vector<JobStatus> jobs() const;
  /// The following throw Error(kFailed, "no job ...") for an unknown job.
  JobStatus job(const JobId& id) const;
  std::vector<TileStatus> tiles(const JobId& id) const;
  ErrorCurve curve(const JobId& id) const;
  Image image(const JobId& id) const;
  Bundle bundle(const std::string& bundle_digest) const;
  void pause(const JobId& id);
  void resume(const JobId& id);
  void cancel(const JobId& id);
  void retry(const JobId& id);
  /// New *totals*; fields that are empty stay. Reopens a finished job.
  void extend(const JobId& id, std::optional<int64_t> spp, std::optional<double> time_s,
              std::optional<double> target_error);
  /// Blocks until job(id).version > version or `timeout_s` passed; returns the newest status.
  JobStatus wait(const JobId& id, uint64_t version, double timeout_s) const;
  /// Evaluates the error of the current image at once and appends it to the curve (a finished job does so
  /// by itself).
  std::vector<WorkerStatus> workers() const;

  // --- workers ---
  /// Throws Error(kUnreachable) with a sentence if the build or schema does not fit.
  WorkerId register_worker(const WorkerRegistration& registration);
  /// Next tile for this worker, if any. Blocks up to `wait_s` for work. Throws Error(kUnreachable) for a
  /// worker that is not registered (after a restart): it registers again.
  std::optional<LeaseGrant> lease(const WorkerId& worker, double wait_s = 0);
  /// Keeps the worker's leases alive; returns those (job, tile, attempt) that it has lost.
  struct LeaseKey { JobId job; TileId tile; int64_t attempt = 0; };
  std::vector<LeaseKey> renew(const WorkerId& worker, const std::vector<LeaseKey>& held);
  /// Durable once it returns kAccepted. A stale attempt is refused in the transaction that would merge it.
  CommitResult commit(const WorkerId& worker, const LeaseKey& lease, const std::string& partial_bytes);
  /// The worker could not render the tile; leased again elsewhere, and after max_attempts the job fails.
  void fail(const WorkerId& worker, const LeaseKey& lease, const std::string& reason);
  /// The worker takes no more leases; those it holds stay until committed or expired.
  void drain(const WorkerId& worker);
  /// Expires leases; called by a timer (and by lease()).
  void tick();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightmill
