#pragma once
// The merged layers of jobs: a cache in memory of what the store holds as snapshot + spool. Only jobs in use
// are in memory, and dropping one is always safe. The cache is bounded in bytes. The layers that were opened
// longest ago go first, with a checkpoint if folding their spool again would cost more.
//
//   Merger::Open layers = merger.open(job, settings);   // locked for this job until it goes out of scope
//   layers->film.fold(partial);
#include <condition_variable>
#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "common/base/ids.h"
#include "common/error/batch_film.h"
#include "common/film/film.h"
#include "common/job/settings.h"

namespace lightmill {

class JobStore;

class Merger {
 public:
  struct Layers {
    Film film;
    BatchFilm batches;
    Image reference;         // empty if the job has none
    double spool_bytes = 0;  // committed since the snapshot
  };

 private:
  struct Slot {
    JobId job;
    std::mutex mutex;
    std::unique_ptr<Layers> layers;  // null: not loaded
    // Guarded by the merger's mutex.
    int users = 0;           // that have it open or wait for it
    uint64_t last_used = 0;  // grows
    double bytes = 0;        // counted towards the bound
  };
  struct Release {
    Merger* merger = nullptr;
    void operator()(Slot* slot) const { merger->release(slot); }
  };

 public:
  /// Exclusive access to one job's layers. A thread has one job open at a time.
  class Open {
   public:
    Layers* operator->() { return slot_->layers.get(); }
    const Layers* operator->() const { return slot_->layers.get(); }

   private:
    friend class Merger;
    explicit Open(std::unique_ptr<Slot, Release> slot) : slot_(std::move(slot)), lock_(slot_->mutex) {}
    std::unique_ptr<Slot, Release> slot_;
    std::unique_lock<std::mutex> lock_;
  };

  /// `max_bytes` bounds film_bytes() over the jobs in memory. A larger job is served alone in memory.
  /// `keep_partials`: partials that a checkpoint contains stay in the store until the job's last checkpoint.
  Merger(JobStore& store, double max_bytes, bool keep_partials = false)
      : store_(store), max_bytes_(max_bytes), keep_partials_(keep_partials) {}

  /// Waits until nobody else has the job open, and for room. Loads it if it isn't in memory. Throws
  /// DamagedLayers if the store's content is damaged, Error(kFailed) or StoreError if it can't be read.
  Open open(const JobId& job, const RenderSettings& settings);
  /// The same without loading: whoever has it keeps others out. Nothing but replace() and reset() may follow
  /// unless it was in memory.
  Open hold(const JobId& job, const RenderSettings& settings);
  /// Puts layers that were made anew in place of what the store has, in memory and as a snapshot.
  void replace(const JobId& job, Open& open, std::unique_ptr<Layers> layers);
  /// Forgets what is in memory, after a fold that did not become durable. `layers` may only be destroyed
  /// then.
  static void reset(Open& layers) { layers.slot_->layers.reset(); }
  /// Writes a snapshot. The job's last one also deletes the partials that were kept.
  void checkpoint(const JobId& job, Open& layers, bool final = false);
  /// Bytes counted towards the bound at present; number of times that layers were read from the store.
  double bytes() const;
  uint64_t loads() const;

 private:
  void release(Slot* slot);
  void make_room(Slot* slot, double wanted);
  void evict(Slot* slot);
  std::unique_ptr<Layers> load(const JobId& job, const RenderSettings& settings);
  void load_film(const JobId& job, const RenderSettings& settings, Layers& layers);

  JobStore& store_;
  const double max_bytes_;
  const bool keep_partials_;
  mutable std::mutex mutex_;
  std::condition_variable room_;
  // Guarded by mutex_.
  std::map<JobId, std::unique_ptr<Slot>> slots_;
  bool waiting_ = false;  // somebody waits for room: nobody gets ahead of it
  double bytes_ = 0;
  uint64_t uses_ = 0, loads_ = 0;
};

}  // namespace lightmill
