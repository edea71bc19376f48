#pragma once
// The farm's words as domain types: what services, workers and clients talk about. No gRPC, no protobuf here;
// convert.h translates to the messages of proto/lightmill/v1.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/error.h"
#include "common/base/ids.h"
#include "common/error/error_curve.h"
#include "common/film/partial.h"
#include "common/image/image.h"
#include "common/job/settings.h"
#include "common/scene/bundle.h"

namespace lightmill {

enum class JobState { kQueued, kRunning, kPaused, kDone, kFailed, kCancelled };
/// "queued", "running", "paused", "done", "failed" or "cancelled".
const char* job_state_name(JobState state);
/// Inverse; empty for any other text.
std::optional<JobState> job_state_from_name(const std::string& name);
/// Done, failed or cancelled: nothing happens to the job by itself any more.
constexpr bool is_final(JobState state) {
  return state == JobState::kDone || state == JobState::kFailed || state == JobState::kCancelled;
}

/// Longest name, pool and submitter of a job.
inline constexpr size_t kMaxNameBytes = 1000;

struct JobRequest {
  std::string name;
  Bundle bundle;
  RenderSettings settings;
  int priority = 0;          // higher first
  std::string pool;          // empty: any worker
  std::string submitter;     // shares the farm with others by this name; empty: all without one together
  int max_workers = 0;       // that render it at the same time; 0: any number
  std::vector<JobId> after;  // it starts once these are done
  double deadline = 0;       // when it is to be done, seconds since 1970; 0: no matter
  Image reference;           // empty, or what --reference gave: adds the true errors to the curve
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
  std::string submitter;
  int max_workers = 0;  // 0: any number
  std::vector<JobId> after;
  double deadline = 0;  // seconds since 1970; 0: none
  int64_t packets_done = 0, packets_total = 0;
  int64_t tiles_committed = 0, tiles_leased = 0;
  int64_t tiles_pending = 0;      // of the round at hand; not told to clients
  int64_t leases_reassigned = 0;  // attempts above the first
  uint64_t commit_bytes = 0;      // of the accepted partials, as they came over the wire
  double spp = 0;                 // mean samples per pixel folded so far
  double wall_seconds = 0;        // render wall time: without pauses and waiting for the first worker
  double cpu_seconds = 0;         // of the workers, from the partials
  double samples_per_second = 0;  // recent
  double eta_seconds = -1;        // -1: unknown
  std::string waiting;            // why no worker has a tile of it; empty: it does not wait
  JobId waits_behind;             // the job that is before it, if it waits for one
  double turn_seconds = -1;       // until its turn comes, about; -1: unknown, or it does not wait
  std::optional<double> relmse, relmse_low, relmse_high;  // last point of the curve
  BoxErrors boxes;                                        // of that point
  std::optional<double> denoised_relmse, denoised_relmse_low,
      denoised_relmse_high;  // of an earlier point, maybe
  RenderCounters counters;
  DroppedShares dropped;
  std::vector<std::string> missing_light;  // what light the image will lack, a line each, for people
  int workers = 0;                         // with a lease on this job
  uint64_t version = 0;                    // grows with every change
};

struct TileStatus {
  TileId id;
  TileSpec tile;      // or the pilot (pilot_result.h)
  std::string state;  // "pending", "leased", "committed"
  int64_t attempt = 0;
  WorkerId worker;
  std::string digest;  // of the committed partial
};

/// Why a worker did not render a tile: something of this tile or of the worker; the scene, with which every
/// worker must fail; memory, of which a larger worker may have enough.
enum class FailureKind { kTile, kScene, kMemory };

struct WorkerRegistration {
  std::string host;
  int threads = 1;
  std::string build;             // build id: program + library versions
  int schema = 0;                // of the partial's encoding
  std::string arithmetic_class;  // digest of the built-in render
  std::string pool;
  uint64_t memory_bytes = 0;  // that it may take; 0: it doesn't say
};

struct WorkerStatus {
  WorkerId id;
  WorkerRegistration registration;
  std::string state;  // "idle", "rendering", "draining", "lost", "refused", "benched"
  int64_t tiles_committed = 0;
  double samples_per_second = 0;
  double seconds_since_seen = 0;
  int64_t partials_refused = 0;
};

/// Some of the workers, in the order of their ids.
struct WorkerPage {
  std::vector<WorkerStatus> workers;
  WorkerId last;     // the next page begins after it; empty: there is none
  size_t total = 0;  // of all pages
};

/// Names one attempt at one tile.
struct LeaseKey {
  JobId job;
  TileId tile;
  int64_t attempt = 0;
  auto operator<=>(const LeaseKey&) const = default;  // NOLINT(modernize-use-nullptr): a 0 of its own
};

/// What a worker needs to render a tile, or to run the pilot (pilot_result.h). `attempt` is the lease's
/// token: monotonic per tile.
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

/// Whether the result says that the partial is kept: nobody may hear of it before that is on disk. The first
/// answer to a repeated commit may have failed just there.
inline bool must_be_durable(CommitResult result) {
  return result == CommitResult::kAccepted || result == CommitResult::kAlreadyCommitted;
}

}  // namespace lightmill
