#pragma once
// The coordinator's store: one SQLite file with a write-ahead log. What it acknowledged survives kill -9 and
// power loss. A transaction syncs the log, or many of them share one sync in flush(). Long byte strings are
// stored in chunks, below SQLite's limit for one value.
#include <atomic>
#include <map>
#include <mutex>

#include "coordinator/store/group_flush.h"
#include "coordinator/store/job_store.h"
#include "coordinator/store/sqlite/sqlite_db.h"

namespace lightmill {

class SqliteJobStore : public JobStore {
 public:
  /// Opens or creates the file. Throws Error(kFailed) if that fails or if a newer version wrote it.
  /// `chunk_bytes`: the longest value that is stored in one piece.
  explicit SqliteJobStore(const std::string& path, size_t chunk_bytes = size_t{256} << 20);

  std::vector<JobRecord> jobs() override;
  std::vector<SequenceRecord> sequences() override;
  std::vector<TileRecord> tiles(const JobId& job) override;
  std::optional<TileRecord> tile(const JobId& job, TileId id) override;
  std::vector<ErrorPoint> curve(const JobId& job) override;
  std::optional<std::string> bundle_json(const std::string& digest) override;
  Image reference(const JobId& job) override;
  std::string pilot(const JobId& job) override;
  LayerSnapshot snapshot(const JobId& job) override;
  void for_each_spooled(const JobId& job, const std::function<void(const std::string&)>& visit) override;
  std::vector<TileId> kept_partials(const JobId& job) override;
  std::string partial(const JobId& job, TileId tile) override;
  int64_t next_number(const std::string& counter) override;
  void add_job(const JobRecord& job, const std::string& bundle_json, const Image& reference) override;
  void save_job(const JobRecord& job) override;
  void save_sequence(const SequenceRecord& sequence) override;
  void add_jobs(const std::vector<NewJob>& jobs) override;
  void save_jobs(const std::vector<JobRecord>& jobs) override;
  void add_tiles(const JobId& job, const std::vector<TileRecord>& tiles) override;
  void split_tile(const JobId& job, const TileRecord& smaller,
                  const std::vector<TileRecord>& others) override;
  void save_tile(const JobRecord& job, const TileRecord& tile) override;
  bool commit_tile(const JobRecord& job, const TileRecord& tile, std::string_view partial) override;
  bool commit_pilot(const JobRecord& job, const TileRecord& pilot, std::string_view report) override;
  void flush() override;
  void add_point(const JobId& job, const ErrorPoint& point) override;
  void checkpoint(const JobId& job, const LayerSnapshot& snapshot, bool keep_partials) override;
  void take_back(const JobRecord& job, const std::vector<TileRecord>& tiles,
                 const LayerSnapshot& rest) override;
  void probe() override;

 private:
  // Within a transaction.
  void insert_job(const JobRecord& job, const std::string& bundle_json);
  void write_job(const JobRecord& job);
  /// The part of a job's row that leases change.
  struct LeasedState {
    JobState state;
    std::string arithmetic_class;
    int64_t leases_reassigned;
    bool operator==(const LeasedState&) const = default;
  };
  static LeasedState leased_state(const JobRecord& job);
  /// All partials of the job are in its snapshot.
  void mark_folded(const JobId& job);
  void set_layer(const JobId& job, const std::string& kind, std::string_view bytes);

  std::mutex mutex_;
  Database db_;
  std::string path_;
  size_t chunk_bytes_;
  size_t attempted_bytes_ = 0;         // of the last write that was long
  std::atomic<int64_t> written_ = 0;   // transactions that are flushed
  std::map<JobId, LeasedState> rows_;  // of jobs, as the file has them; absent: not known
  GroupFlush group_;
};

}  // namespace lightmill
