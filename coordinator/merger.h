#pragma once
// The merged layers of jobs: a cache in memory of what the store holds as snapshot + spool. Only jobs that
// are being touched are in memory; dropping one is always safe.
//
//   Merger::Open layers = merger.open(job, settings);   // locked for this job until it goes out of scope
//   layers->film.fold(partial);
#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "common/ids.h"
#include "common/image/error_curve.h"
#include "common/image/film.h"
#include "common/settings.h"

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
    std::mutex mutex;
    std::unique_ptr<Layers> layers;  // null: not loaded
  };

 public:
  /// Exclusive access to one job's layers.
  class Open {
   public:
    Layers* operator->() { return slot_->layers.get(); }
    const Layers* operator->() const { return slot_->layers.get(); }

   private:
    friend class Merger;
    explicit Open(std::shared_ptr<Slot> slot) : slot_(std::move(slot)), lock_(slot_->mutex) {}
    std::shared_ptr<Slot> slot_;
    std::unique_lock<std::mutex> lock_;
  };

  explicit Merger(JobStore& store) : store_(store) {}

  /// Waits until nobody else has the job open; loads it if it isn't in memory. Throws Error(kFailed) if the
  /// store's content is damaged, StoreError if it can't be read.
  Open open(const JobId& job, const RenderSettings& settings);
  /// Forgets what is in memory after a fold that did not become durable; `layers` must not be used any more
  /// except to be destroyed.
  static void reset(Open& layers) { layers.slot_->layers.reset(); }
  /// Writes a snapshot and empties the spool.
  void checkpoint(const JobId& job, Open& layers);

 private:
  static constexpr size_t kMaxLoaded = 4;
  JobStore& store_;
  std::mutex mutex_;
  std::map<JobId, std::shared_ptr<Slot>> slots_;
};

}  // namespace lightmill
