#pragma once
// The tiles of one job and the workers that hold them. Pure: time is an argument, nothing is stored
// elsewhere.
//
// The owner decides, makes the decision durable, then applies it:
//   TileRecord leased = table.leased_to(*table.next_pending(...), worker);
//   store.save_tile(job, leased);
//   table.apply(leased, now + lease_seconds);
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "coordinator/farm/job_record.h"

namespace lightmill {

class LeaseTable {
 public:
  /// Tiles with the same sample range, opened together. The pilot belongs to none.
  struct Round {
    int64_t begin = 0, end = 0;  // sample range
    int64_t tiles = 0, committed = 0;
  };

  /// Adds the pilot or a round's tiles; ids go on from the last one. A stored ledger is added in the same
  /// way, round after round.
  void add(const std::vector<TileRecord>& tiles);
  /// The tiles that are not forgotten, ascending by id.
  const std::deque<TileRecord>& tiles() const { return tiles_; }
  /// The id of the next tile, which is also the number of tiles.
  int64_t next_id() const { return forgotten_ + static_cast<int64_t>(tiles_.size()); }
  /// Forgets the oldest tiles of committed rounds while more than `keep` are there. Those of the last such
  /// round stay. Rounds and all counts stay as they are.
  void forget(size_t keep);
  /// Tiles below this id are forgotten. All of them were committed.
  int64_t forgotten() const { return forgotten_; }
  /// Null if there is no such tile, or if it is forgotten.
  const TileRecord* find(TileId id) const;
  const std::vector<Round>& rounds() const { return rounds_; }
  /// First sample index that no round covers.
  int64_t planned_samples() const { return rounds_.empty() ? 0 : rounds_.back().end; }
  /// Largest s such that all rounds that end at or before s are committed.
  int64_t complete_samples() const { return complete_rounds_ > 0 ? rounds_[complete_rounds_ - 1].end : 0; }

  /// The pending tile of lowest id for which `accept` returns true.
  std::optional<TileId> next_pending(const std::function<bool(const TileRecord&)>& accept) const;
  const std::set<int64_t>& pending() const { return pending_; }  // their ids
  bool has_pending() const { return !pending_.empty(); }
  int64_t pending_count() const { return static_cast<int64_t>(pending_.size()); }
  int64_t leased_count() const { return static_cast<int64_t>(leased_.size()); }
  /// A valid lease.
  struct Lease {
    TileId tile;
    int64_t attempt = 0;
    WorkerId worker;
    double since = 0, expires = 0;
    int pins = 0;
  };
  /// Whether `worker` holds the tile with this attempt.
  bool holds(TileId id, const WorkerId& worker, int64_t attempt) const;
  /// Number of workers that hold a tile; whether this one does.
  int workers() const { return static_cast<int>(holders_.size()); }
  bool has_worker(const WorkerId& worker) const { return holders_.contains(worker); }
  /// All leases, by tile and attempt. A tile that two workers race for has two.
  std::vector<Lease> leases() const;
  /// When a valid lease began.
  double leased_since(TileId id, int64_t attempt) const { return leases_.at({id.value, attempt}).since; }
  /// The leases of one tile.
  std::vector<Lease> leases_of(TileId id) const;

  /// The tile's row after a lease: attempt + 1. A leased tile may be leased again (TileRecord).
  TileRecord leased_to(TileId id, const WorkerId& worker) const;
  /// The row after this lease ends without a commit.
  TileRecord released(TileId id, int64_t attempt, bool failed) const;
  /// The row with this lease among those that the store keeps, as a commit under it needs.
  TileRecord with_stored(TileId id, int64_t attempt) const;
  /// The row after a commit under this lease, which ends the tile's other leases.
  TileRecord committed(TileId id, int64_t attempt, const std::string& digest) const;
  /// Replaces the row. Leases that it does not name any more end. `since` and `expires`, in seconds of the
  /// clock, are those of a lease that is new.
  void apply(const TileRecord& record, double expires = 0, double since = 0);
  /// Splits a pending tile of the last round into two parts or more. Its cells must be those of `parts`
  /// together.
  struct Split {
    TileRecord smaller;
    std::vector<TileRecord> others;
  };
  bool may_split(TileId id) const;
  Split split(TileId id, const std::vector<CellRect>& parts) const;
  void apply(const Split& split);
  /// Moves the expiry of a lease.
  void renew(TileId id, int64_t attempt, double expires);
  /// Holds a lease while a commit under it is in progress. It does not expire before as many unpins.
  void pin(TileId id, int64_t attempt);
  void unpin(TileId id, int64_t attempt);
  /// Expired leases, by tile and attempt. Takes time for those whose first or renewed time has come since the
  /// last call, however many leases there are.
  std::vector<Lease> expired(double now);

 private:
  static constexpr size_t kNoRound = SIZE_MAX;
  using Key = std::pair<int64_t, int64_t>;  // tile, attempt
  Lease* find_lease(TileId id, int64_t attempt);
  void end_lease(std::map<Key, Lease>::iterator lease);
  /// Keeps only the entries of present leases.
  void rebuild_expiries();
  /// Updates the holders for leases of a row that begin or have ended.
  void follow(const TileRecord& record, double expires, double since);

  void count_complete_rounds();
  size_t index(TileId id) const { return static_cast<size_t>(id.value - forgotten_); }

  int64_t forgotten_ = 0;
  std::deque<TileRecord> tiles_;  // index = id - forgotten_
  std::vector<Round> rounds_;
  size_t complete_rounds_ = 0;   // number of rounds, from the first one, that are committed
  std::deque<size_t> round_of_;  // per tile; kNoRound: the pilot
  std::set<int64_t> pending_, leased_;
  std::map<Key, Lease> leases_;
  std::map<WorkerId, int> holders_;  // leases held, above 0
  /// A heap, the earliest first: for every lease one time at or after which it expires. That it was renewed
  /// is noticed when that time has come. Some entries of ended leases are left.
  std::vector<std::pair<double, Key>> expiries_;
};

}  // namespace lightmill
