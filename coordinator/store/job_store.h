#pragma once
// Where jobs live: the seam between the farm and its disk. Every method that changes something is one
// transaction; a failing disk throws StoreError and changes nothing. All are durable when they return, but
// those marked *flushed*: a crash of the process cannot undo them, a power cut can until flush() returns, or
// another write that is durable. Thread-safe.
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/error/error_curve.h"
#include "coordinator/farm/job_record.h"

namespace lightmill {

/// A job's merged layers at some point of time; both empty if there is none yet.
struct LayerSnapshot {
  std::string film;     // Film::snapshot()
  std::string batches;  // BatchFilm::snapshot()
};

/// The disk failed, or what it holds is damaged: nobody's request is at fault.
class StoreError : public Error {
 public:
  explicit StoreError(const std::string& message) : Error(ErrorKind::kFailed, message) {}
};

class JobStore {
 public:
  virtual ~JobStore() = default;

  /// False if this store keeps neither partials nor snapshots: the layers that a merger has in memory are all
  /// that there is of them.
  virtual bool keeps_layers() const { return true; }

  // --- reading ---
  /// All jobs, in the order of their submission.
  virtual std::vector<JobRecord> jobs() = 0;
  /// The job's ledger, ascending by id.
  virtual std::vector<TileRecord> tiles(const JobId& job) = 0;
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
  /// One of them; empty if it is not kept.
  virtual std::string partial(const JobId& job, TileId tile) = 0;

  // --- writing ---
  /// 1, 2, 3, ...: never the same twice for one `counter`, also after a restart. Flushed.
  virtual int64_t next_number(const std::string& counter) = 0;
  virtual void add_job(const JobRecord& job, const std::string& bundle_json, const Image& reference) = 0;
  virtual void save_job(const JobRecord& job) = 0;
  /// Flushed.
  virtual void add_tiles(const JobId& job, const std::vector<TileRecord>& tiles) = 0;
  /// A pending tile becomes smaller, and others with the ids that come next take the rest. Flushed.
  virtual void split_tile(const JobId& job, const TileRecord& smaller,
                          const std::vector<TileRecord>& others) = 0;
  /// Writes both rows: a lease, an expiry, a failure. Flushed: a lease that a power cut forgets is void
  /// anyway, as its worker must register again and no worker's id comes twice.
  virtual void save_tile(const JobRecord& job, const TileRecord& tile) = 0;
  /// In one transaction: checks that the tile is leased under the token that `tile` was committed under, puts
  /// the partial into the spool, marks the tile committed and writes the job row. False, without any change,
  /// if the check fails. Flushed: nothing may be acknowledged before flush().
  virtual bool commit_tile(const JobRecord& job, const TileRecord& tile, std::string_view partial) = 0;
  /// The same for the pilot: keeps its report in place of a partial. The job row brings the chosen plan.
  virtual bool commit_pilot(const JobRecord& job, const TileRecord& pilot, std::string_view report) = 0;
  /// Makes durable all that was written before the call. Calls at the same time share the work (group
  /// commit).
  virtual void flush() = 0;
  virtual void add_point(const JobId& job, const ErrorPoint& point) = 0;
  /// Replaces the snapshot, which must contain all partials of the spool. They go, unless they are to be
  /// kept.
  virtual void checkpoint(const JobId& job, const LayerSnapshot& snapshot, bool keep_partials) = 0;
  /// Takes committed tiles back: writes the rows as they are given, throws their partials and the snapshot
  /// away, and has the partials that are kept folded anew. They must be all that the job has committed
  /// besides.
  /// The curve begins anew.
  virtual void take_back(const JobRecord& job, const std::vector<TileRecord>& tiles) = 0;
  /// Throws StoreError unless as much as the largest recent write can be written, and all that was written
  /// before is durable: to see whether a store that failed is mended.
  virtual void probe() = 0;
};

}  // namespace lightmill
