#pragma once
// The tiles of one job and who holds them. Pure: time is an argument, nothing is stored elsewhere.
//
// The owner decides, makes the decision durable, then applies it:
//   TileRecord leased = table.leased_to(*table.next_pending(...), worker);
//   store.save_tile(job, leased);
//   table.apply(leased, now + lease_seconds);
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "coordinator/job_record.h"

namespace lightmill {

class LeaseTable {
 public:
  /// Tiles with the same sample range, opened together. The pilot belongs to none.
  struct Round {
    int64_t begin = 0, end = 0;  // sample range
    int64_t tiles = 0, committed = 0;
  };

  /// Adds the pilot or a round's tiles; their ids go on from the last one. Also for a stored ledger, round
  /// after round.
  void add(const std::vector<TileRecord>& tiles);
  const std::vector<TileRecord>& tiles() const { return tiles_; }
  /// Null if there is no such tile.
  const TileRecord* find(TileId id) const;
  const std::vector<Round>& rounds() const { return rounds_; }
  /// First sample index that no round covers.
  int64_t planned_samples() const { return rounds_.empty() ? 0 : rounds_.back().end; }
  /// Largest s such that all rounds that end at or before s are committed.
  int64_t complete_samples() const;

  /// The pending tile of lowest id that `accept` takes.
  std::optional<TileId> next_pending(const std::function<bool(const TileRecord&)>& accept) const;
  bool has_pending() const { return !pending_.empty(); }
  int64_t leased_count() const { return static_cast<int64_t>(leased_.size()); }
  /// True if `worker` holds the tile with this attempt.
  bool holds(TileId id, const WorkerId& worker, int64_t attempt) const;
  /// How many workers hold a tile, and whether this one does.
  int workers() const { return static_cast<int>(holders_.size()); }
  bool has_worker(const WorkerId& worker) const { return holders_.contains(worker); }
  /// Tiles held by anybody, ascending.
  std::vector<TileId> leased() const;

  /// What the tile's row becomes by a lease: attempt + 1.
  TileRecord leased_to(TileId id, const WorkerId& worker) const;
  /// What it becomes when a lease ends without a commit.
  TileRecord released(TileId id, bool failed) const;
  /// Replaces the row. `expires` counts for leased rows only, in seconds of the clock.
  void apply(const TileRecord& record, double expires = 0);
  /// Moves the expiry of a leased tile.
  void renew(TileId id, double expires);
  /// Holds a leased tile while a commit of it is in progress: it does not expire before as many unpins.
  void pin(TileId id);
  void unpin(TileId id);
  /// Leased tiles whose time is over.
  std::vector<TileId> expired(double now) const;

 private:
  static constexpr size_t kNoRound = SIZE_MAX;
  std::vector<TileRecord> tiles_;  // index = id
  std::vector<Round> rounds_;
  std::vector<size_t> round_of_;  // per tile; kNoRound: the pilot
  std::set<int64_t> pending_;
  struct Lease {
    double expires = 0;
    int pins = 0;
  };
  std::map<int64_t, Lease> leased_;
  std::map<WorkerId, int> holders_;  // tiles held, above 0
};

}  // namespace lightmill
