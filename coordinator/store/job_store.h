#pragma once
// Where jobs are stored: the seam between the farm and its disk. Every method that changes something is one
// transaction. If the disk fails it throws StoreError and changes nothing. Changes are durable when the
// method returns, except for those marked *flushed*: a crash of the process cannot undo them, but a power cut
// can, until flush() returns or another write is durable. Thread-safe.
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/error/error_curve.h"
#include "coordinator/farm/job_record.h"

namespace lightmill {

/// A job's merged layers at some point of time. Both are empty if there are none yet.
struct LayerSnapshot {
  std::string film;     // Film::snapshot()
  std::string batches;  // BatchFilm::snapshot()
};

/// The disk failed, or its content is damaged. No request is at fault.
class StoreError : public Error {
 public:
  explicit StoreError(const std::string& message) : Error(ErrorKind::kFailed, message) {}
};

/// A job's stored layers are there and wrong, or are gone for good: proof of damage, where a plain Error says
/// that they can't be read now.
class DamagedLayers : public Error {
 public:
  explicit DamagedLayers(const std::string& message) : Error(ErrorKind::kFailed, message) {}
};

/// A job that is to be stored, with its bundle's manifest.
struct NewJob {
  JobRecord record;
  std::string bundle_json;
};

/// No ledger goes beyond.
inline constexpr TileId kLastTile{std::numeric_limits<int64_t>::max()};

class JobStore {
 public:
  virtual ~JobStore() = default;

  /// False if this store keeps neither partials nor snapshots: then they exist only in the merger's memory.
  virtual bool keeps_layers() const { return true; }

  // --- reading ---
  /// All jobs, in the order of their submission.
  virtual std::vector<JobRecord> jobs() = 0;
  /// All sequences, in the order of their submission.
  virtual std::vector<SequenceRecord> sequences() = 0;
  /// The job's ledger, ascending by id.
  virtual std::vector<TileRecord> tiles(const JobId& job) = 0;
  /// One row of it; absent if there is none. Costs no more in a long ledger.
  virtual std::optional<TileRecord> tile(const JobId& job, TileId id) = 0;
  virtual std::vector<ErrorPoint> curve(const JobId& job) = 0;
  /// Manifest text of a bundle that some job names.
  virtual std::optional<std::string> bundle_json(const std::string& digest) = 0;
  /// The job's reference image; empty if it has none.
  virtual Image reference(const JobId& job) = 0;
  /// JSON of the committed pilot's report; empty if there is none.
  virtual std::string pilot(const JobId& job) = 0;
  virtual LayerSnapshot snapshot(const JobId& job) = 0;
  /// Calls `visit` with every encoded partial that was committed after the snapshot.
  virtual void for_each_spooled(const JobId& job, const std::function<void(const std::string&)>& visit) = 0;
  /// Tiles whose partials are kept, in the snapshot or not, ascending.
  virtual std::vector<TileId> kept_partials(const JobId& job) = 0;
  /// One of these partials; empty if it is not kept.
  virtual std::string partial(const JobId& job, TileId tile) = 0;

  // --- writing ---
  /// 1, 2, 3, ...: never the same twice for one `counter`, not even after a restart. Flushed.
  virtual int64_t next_number(const std::string& counter) = 0;
  virtual void add_job(const JobRecord& job, const std::string& bundle_json, const Image& reference) = 0;
  virtual void save_job(const JobRecord& job) = 0;
  /// Adds the sequence, or replaces its row.
  virtual void save_sequence(const SequenceRecord& sequence) = 0;
  /// As add_job and save_job for each, in one transaction.
  virtual void add_jobs(const std::vector<NewJob>& jobs) = 0;
  virtual void save_jobs(const std::vector<JobRecord>& jobs) = 0;
  /// Flushed.
  virtual void add_tiles(const JobId& job, const std::vector<TileRecord>& tiles) = 0;
  /// Makes a pending tile smaller, and adds others with the next ids for the rest. Flushed.
  virtual void split_tile(const JobId& job, const TileRecord& smaller,
                          const std::vector<TileRecord>& others) = 0;
  /// Writes both rows: a lease, an expiry, a failure. Flushed: a lease that a power cut undoes is void
  /// anyway, as its worker must register again and worker ids are never reused.
  virtual void save_tile(const JobRecord& job, const TileRecord& tile) = 0;
  /// In one transaction: checks that the tile is leased under the token that `tile` was committed under, puts
  /// the partial into the spool, marks the tile as committed and writes the job's row. Returns false, without
  /// any change, if the check fails. Flushed: nothing may be acknowledged before flush().
  virtual bool commit_tile(const JobRecord& job, const TileRecord& tile, std::string_view partial) = 0;
  /// The same for the pilot: keeps its report in place of a partial. The job's row has the chosen plan.
  virtual bool commit_pilot(const JobRecord& job, const TileRecord& pilot, std::string_view report) = 0;
  /// Makes everything durable that was written before the call. Simultaneous calls share the work (group
  /// commit).
  virtual void flush() = 0;
  virtual void add_point(const JobId& job, const ErrorPoint& point) = 0;
  /// Replaces the snapshot. It must contain all partials of the spool. These are deleted unless
  /// `keep_partials`.
  virtual void checkpoint(const JobId& job, const LayerSnapshot& snapshot, bool keep_partials) = 0;
  /// Takes committed tiles back: writes the rows as they are given, and deletes their partials. `rest`, the
  /// layers of all other tiles that the job has committed, becomes the snapshot. If it is empty the kept
  /// partials, which must then be all others, are folded anew. The curve begins anew.
  virtual void take_back(const JobRecord& job, const std::vector<TileRecord>& tiles,
                         const LayerSnapshot& rest) = 0;
  /// Throws StoreError unless as much as the largest recent write can be written, and all that was written
  /// before is durable. This tells whether a store that failed is mended.
  virtual void probe() = 0;
};

}  // namespace lightmill
