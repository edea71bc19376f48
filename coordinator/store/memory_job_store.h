#pragma once
// A store that lives as long as the process: for `lightmill render` and for tests.
#include <map>
#include <mutex>
#include <set>

#include "coordinator/store/job_store.h"

namespace lightmill {

class MemoryJobStore : public JobStore {
 public:
  /// Without `keep_layers` it saves a copy of every partial, for a process that ends with its only job. Then
  /// no merger may need more memory than it has (merger.h): a film that it drops is lost.
  explicit MemoryJobStore(bool keep_layers = true) : keep_layers_(keep_layers) {}
  bool keeps_layers() const override { return keep_layers_; }
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
  void flush() override {}
  void add_point(const JobId& job, const ErrorPoint& point) override;
  void checkpoint(const JobId& job, const LayerSnapshot& snapshot, bool keep_partials) override;
  void take_back(const JobRecord& job, const std::vector<TileRecord>& tiles,
                 const LayerSnapshot& rest) override;
  void probe() override {}

 private:
  struct Entry {
    JobRecord record;
    std::vector<TileRecord> tiles;  // index = id
    std::vector<ErrorPoint> curve;
    Image reference;
    std::string pilot;
    LayerSnapshot snapshot;
    std::map<TileId, std::string> spool;
    std::set<TileId> folded;  // of the spool: in the snapshot, too
  };
  Entry& entry(const JobId& job);
  void insert(const JobRecord& job, const std::string& bundle_json, const Image& reference);
  TileRecord& row(Entry& entry, const TileId& id);
  /// Writes both rows if the tile is leased with this attempt by this worker.
  bool mark_committed(Entry& entry, const JobRecord& job, const TileRecord& tile);

  const bool keep_layers_;
  std::mutex mutex_;
  std::vector<JobId> order_;
  std::map<JobId, Entry> jobs_;
  std::vector<SequenceRecord> sequences_;
  std::map<std::string, std::string> bundles_;
  std::map<std::string, int64_t> counters_;
};

}  // namespace lightmill
