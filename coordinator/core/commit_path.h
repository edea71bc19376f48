#pragma once
// The way of a partial into the film, under the lease that its worker holds:
//
//   claim    the lease is good, and does not run out meanwhile       FarmState::mutex
//   decode   the bytes are a partial, and the one of this tile       no lock
//   open     the job's layers                                        the job's layers from here on
//   fold     into the layers, where nobody sees it yet
//   record   store, then memory; or the layers are forgotten         and FarmState::mutex
//   settle   round and job ends, checkpoints
//
// A pilot's result and a tile rendered to compare leave it after `claim` and `decode` (PilotCommits,
// SpotChecks).
//
// The caller of any method must not hold FarmState::mutex or layers.
#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include "coordinator/core/farm_state.h"
#include "coordinator/core/leases.h"
#include "coordinator/core/pilots/pilot_commits.h"
#include "coordinator/core/repair/storage_guard.h"
#include "coordinator/core/round_ends.h"
#include "coordinator/core/spot_checks.h"
#include "coordinator/merge/decoder_pool.h"

namespace lightmill {

class CommitPath {
 public:
  CommitPath(FarmState& farm, StorageGuard& storage, Leases& leases, RoundEnds& ends, SpotChecks& checks);

  /// Farm::commit_unflushed.
  CommitResult commit(const WorkerId& worker, const LeaseKey& lease, const std::string& bytes,
                      std::string* reason);
  /// Farm::announce_commit.
  std::variant<CommitResult, uint64_t> announce(const WorkerId& worker, const LeaseKey& lease);

 private:
  /// What a worker hands in.
  struct Delivery {
    const WorkerId& worker;
    const LeaseKey& lease;
    const std::string& bytes;
    std::string* reason;  // receives why it was refused; may be null
  };
  /// What a lease is for that is good, and pinned.
  struct Claim {
    TileSpec tile;
    RenderSettings settings;
    std::optional<int> quantum_exponent;
    bool is_check = false;
  };
  /// A good lease's tile.
  struct Held {
    Job* job;
    TileRecord tile;
  };
  /// Lets a pinned lease expire again, at the end of its scope.
  struct Unpin {
    CommitPath& path;
    const Delivery& delivery;
    ~Unpin();
  };

  /// The lease's tile if the lease is good; otherwise what its commit is answered, which is then counted.
  /// Wants FarmState::mutex held.
  std::variant<CommitResult, Held> look_up(const WorkerId& worker, const LeaseKey& lease);
  /// Pins the lease, or says what the commit is answered.
  std::variant<CommitResult, Claim> claim(const Delivery& delivery);
  /// The tile's row, of a job that has ended from the store.
  std::optional<TileRecord> find_tile(const Job& job, TileId id) const;
  CommitResult take_pilot(const Delivery& delivery);
  CommitResult take_partial(const Delivery& delivery, const Claim& claim);
  /// Absent where this job's layers are damaged: the worker has better things to do than to wait with the
  /// job.
  std::optional<Merger::Open> open_layers(const Delivery& delivery, const Claim& claim);
  /// Makes a folded partial durable and applies it; false if the lease is no longer good. The layers are
  /// forgotten where it did not become durable.
  bool record(const Delivery& delivery, const Claim& claim, const Partial& partial, const std::string& digest,
              Merger::Open& layers);
  /// The part of record() that wants FarmState::mutex held.
  bool record_locked(const Delivery& delivery, const Claim& claim, const Partial& partial,
                     const std::string& digest);
  /// Job, worker and farm count an accepted partial. Wants FarmState::mutex held. `since`: of the lease.
  void count(Job& job, const Delivery& delivery, const Claim& claim, const Partial& partial, double since,
             double now);
  /// The commit stands; what follows may fail, then a later tick tries again.
  void settle(const Delivery& delivery, Merger::Open& layers);
  /// The bytes are none that an honest, sound worker sends.
  CommitResult refuse(const Delivery& delivery, const std::string& why);

  FarmState& farm_;
  StorageGuard& storage_;
  Leases& leases_;
  RoundEnds& ends_;
  SpotChecks& checks_;
  PilotCommits pilots_;
  DecoderPool decoders_;
};

}  // namespace lightmill
