#pragma once
// The store of a farm that outgrows one machine's disk. Rows and partials are in PostgreSQL. Films, batches,
// references and blobs are files in a folder that the coordinators of the farm share. fenced_connection.h
// says which transactions count. After any failure nothing is written before probe().
#include <atomic>
#include <functional>
#include <mutex>
#include <optional>

#include "coordinator/store/job_store.h"
#include "coordinator/store/layer_files.h"
#include "coordinator/store/postgres/fenced_connection.h"

namespace lightmill {

class PostgresJobStore : public JobStore {
 public:
  /// `lease` must be held, and outlive the store. `folder`: the shared one. Throws StoreError if the database
  /// can't be used, or if the folder is not the one that its jobs are in. `chunk_bytes`: the longest partial
  /// that is stored in one piece.
  PostgresJobStore(PostgresLease& lease, const std::string& folder, size_t chunk_bytes = size_t{64} << 20);

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
  using Durability = FencedConnection::Durability;
  /// A file that a row of `layers` names, or is about to.
  struct Layer {
    std::string file, digest;
  };

  void claim_folder(const std::string& folder);
  void remove_orphans();
  Layer put_file(const JobId& job, const std::string& kind, std::string_view bytes);
  /// `layers_mutex_` must be held.
  std::string get_layer(const JobId& job, const std::string& kind);
  /// Files of the job's film and batches that its rows name.
  static std::vector<std::string> snapshot_files(PostgresConnection& db, const JobId& job);
  /// All partials of the job are in its snapshot.
  static void mark_folded(PostgresConnection& db, const JobId& job);

  PostgresLease& lease_;
  FencedConnection db_;
  LayerFiles files_;
  const size_t chunk_bytes_;
  std::atomic<size_t> attempted_bytes_ = 0;  // of the last write that was long
  std::atomic<int64_t> next_file_ = 0;
  std::mutex layers_mutex_;  // a file is not removed while it is read
};

}  // namespace lightmill
