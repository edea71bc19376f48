#pragma once
// Wraps a store and tells StorageHealth of every failure.
#include <memory>
#include <utility>

#include "common/base/clock.h"
#include "coordinator/store/job_store.h"
#include "coordinator/store/storage_health.h"

namespace lightmill {

class GuardedJobStore : public JobStore {
 public:
  GuardedJobStore(std::unique_ptr<JobStore> store, StorageHealth& health, const Clock& clock)
      : store_(std::move(store)), health_(health), clock_(clock) {}

  bool keeps_layers() const override { return store_->keeps_layers(); }
  std::vector<JobRecord> jobs() override {
    return guarded([&] { return store_->jobs(); });
  }
  std::vector<SequenceRecord> sequences() override {
    return guarded([&] { return store_->sequences(); });
  }
  std::vector<TileRecord> tiles(const JobId& job) override {
    return guarded([&] { return store_->tiles(job); });
  }
  std::optional<TileRecord> tile(const JobId& job, TileId id) override {
    return guarded([&] { return store_->tile(job, id); });
  }
  std::vector<ErrorPoint> curve(const JobId& job) override {
    return guarded([&] { return store_->curve(job); });
  }
  std::optional<std::string> bundle_json(const std::string& digest) override {
    return guarded([&] { return store_->bundle_json(digest); });
  }
  Image reference(const JobId& job) override {
    return guarded([&] { return store_->reference(job); });
  }
  std::string pilot(const JobId& job) override {
    return guarded([&] { return store_->pilot(job); });
  }
  LayerSnapshot snapshot(const JobId& job) override {
    return guarded([&] { return store_->snapshot(job); });
  }
  void for_each_spooled(const JobId& job, const std::function<void(const std::string&)>& visit) override {
    guarded([&] { store_->for_each_spooled(job, visit); });
  }
  std::vector<TileId> kept_partials(const JobId& job) override {
    return guarded([&] { return store_->kept_partials(job); });
  }
  std::string partial(const JobId& job, TileId tile) override {
    return guarded([&] { return store_->partial(job, tile); });
  }
  int64_t next_number(const std::string& counter) override {
    return guarded([&] { return store_->next_number(counter); });
  }
  void add_job(const JobRecord& job, const std::string& bundle_json, const Image& reference) override {
    guarded([&] { store_->add_job(job, bundle_json, reference); });
  }
  void save_job(const JobRecord& job) override {
    guarded([&] { store_->save_job(job); });
  }
  void save_sequence(const SequenceRecord& sequence) override {
    guarded([&] { store_->save_sequence(sequence); });
  }
  void add_jobs(const std::vector<NewJob>& jobs) override {
    guarded([&] { store_->add_jobs(jobs); });
  }
  void save_jobs(const std::vector<JobRecord>& jobs) override {
    guarded([&] { store_->save_jobs(jobs); });
  }
  void add_tiles(const JobId& job, const std::vector<TileRecord>& tiles) override {
    guarded([&] { store_->add_tiles(job, tiles); });
  }
  void split_tile(const JobId& job, const TileRecord& smaller,
                  const std::vector<TileRecord>& others) override {
    guarded([&] { store_->split_tile(job, smaller, others); });
  }
  void save_tile(const JobRecord& job, const TileRecord& tile) override {
    guarded([&] { store_->save_tile(job, tile); });
  }
  bool commit_tile(const JobRecord& job, const TileRecord& tile, std::string_view partial) override {
    return guarded([&] { return store_->commit_tile(job, tile, partial); });
  }
  bool commit_pilot(const JobRecord& job, const TileRecord& pilot, std::string_view report) override {
    return guarded([&] { return store_->commit_pilot(job, pilot, report); });
  }
  void flush() override {
    guarded([&] { store_->flush(); });
  }
  void add_point(const JobId& job, const ErrorPoint& point) override {
    guarded([&] { store_->add_point(job, point); });
  }
  void checkpoint(const JobId& job, const LayerSnapshot& snapshot, bool keep_partials) override {
    guarded([&] { store_->checkpoint(job, snapshot, keep_partials); });
  }
  void take_back(const JobRecord& job, const std::vector<TileRecord>& tiles,
                 const LayerSnapshot& rest) override {
    guarded([&] { store_->take_back(job, tiles, rest); });
  }
  void probe() override { store_->probe(); }

 private:
  template <class Action>
  auto guarded(Action&& action) -> decltype(action()) {
    try {
      return action();
    } catch (const StoreError& error) {
      health_.failed(error.what(), clock_.now());
      throw;
    }
  }

  std::unique_ptr<JobStore> store_;
  StorageHealth& health_;
  const Clock& clock_;
};

}  // namespace lightmill
