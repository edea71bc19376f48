#pragma once
// What the store keeps of a job and of its tiles.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/farm/farm_types.h"
#include "common/farm/pilot_result.h"
#include "common/farm/sequence_types.h"

namespace lightmill {

enum class TileState : int { kPending = 0, kLeased = 1, kCommitted = 2 };
/// "pending", "leased" or "committed".
const char* tile_state_name(TileState state);

/// One worker's right to commit a tile.
struct LeaseToken {
  int64_t attempt = 0;
  WorkerId worker;
  bool operator==(const LeaseToken&) const = default;
};

/// Whether another worker renders a committed tile once more, to compare.
enum class TileCheck : int { kNone = 0, kWanted = 1, kPassed = 2 };

/// A row of the ledger: a tile, or first of all the job's pilot (common/farm/pilot_result.h).
///
/// A tile may be leased to several workers at the same time, who race for it. The store keeps the newest
/// lease and the one before as `rival_…`; all others are in memory only. If the newest one ends first,
/// `worker` is empty and the others go on. Of a committed tile only the lease stays that counted.
struct TileRecord {
  TileId id;
  TileSpec tile;
  TileState state = TileState::kPending;
  int64_t attempt = 0;        // leases so far
  int failures = 0;           // attempts that ended in a failure report, a corrupt partial or silence
  WorkerId worker;            // of the last lease
  std::string digest;         // of the committed partial's content
  int64_t rival_attempt = 0;  // 0: no race
  WorkerId rival_worker;
  std::vector<LeaseToken> others{};  // in memory only: leases before the rival's
  TileCheck check = TileCheck::kNone;
  bool operator==(const TileRecord&) const = default;
};

/// The leases that are good, of a leased tile: one or more, the newest last. The one that counted, of a
/// committed tile. The last one, of a pending tile, if it ever had one.
std::vector<LeaseToken> lease_tokens(const TileRecord& tile);
/// True if the tile was committed under this lease.
bool committed_under(const TileRecord& tile, const LeaseToken& token);
/// What a leased tile of the store is once its leases are void.
TileRecord voided(TileRecord tile);
/// For clients: of a committed tile the lease that counted, else the last one.
TileStatus tile_status(const TileRecord& tile);
/// "job j7 tile 3", "job j7 pilot".
std::string tile_name(const LeaseKey& key, bool pilot);
/// "tile 3 (cells 0,0 to 2,2, samples 16 to 32)", "the pilot".
std::string tile_text(const TileRecord& tile);

/// How often a job or sequence has ended, and up to which of these ends hooks were told (coordinator/hooks/).
struct Ends {
  int count = 0, told = 0;
  bool untold() const { return told < count; }
};

/// A job without its tiles. The totals are over the committed tiles.
struct JobRecord {
  JobId id;
  std::string name;
  std::string bundle_digest;
  RenderSettings settings;
  int priority = 0;
  std::string pool;
  std::string submitter;
  int max_workers = 0;           // 0: any number
  std::vector<JobId> after;      // jobs that must be done before its first lease
  double deadline = 0;           // seconds since 1970; 0: none
  std::optional<FrameOf> frame;  // of a sequence; name, priority, pool and the like are the sequence's
  JobState state = JobState::kQueued;
  Ends ends;
  std::string message;
  std::string arithmetic_class;         // of the first worker that got a lease; empty before
  std::optional<int> quantum_exponent;  // of the first committed partial
  bool target_met = false;              // --target-error was reached: no more rounds
  double wall_seconds = 0;
  double cpu_seconds = 0;
  int64_t packets_done = 0;
  int64_t tiles_committed = 0;
  int64_t leases_reassigned = 0;
  int64_t pixel_samples = 0;
  uint64_t commit_bytes = 0;  // of the accepted partials
  RenderCounters counters;
  Dropped dropped;
  std::optional<double> image_mean;  // Film::mean_magnitude when it was last needed: for shares of `dropped`
  std::vector<std::string> missing_light;  // as in JobStatus
};

/// A sequence without its frames, which are jobs.
struct SequenceRecord {
  SequenceId id;
  SequenceRequest request;
  Ends ends;  // the last one may not have come yet
};
/// JSON text of everything but the id, and back; throws Error(kFailed) on malformed text.
std::string sequence_record_to_json(const SequenceRecord& record);
SequenceRecord sequence_record_from_json(const SequenceId& id, const std::string& text);

/// JSON text of everything but the id, and back; throws Error(kFailed) on malformed text.
std::string job_record_to_json(const JobRecord& record);
JobRecord job_record_from_json(const JobId& id, const std::string& text);

}  // namespace lightmill
