#pragma once
// The tiles of one job and who holds them. Pure: time is an argument, nothing is stored elsewhere.
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

  /// Adds the pilot or a round's tiles; their ids go on from the last one. Also for a stored ledger, round
  /// after round.
  void add(const std::vector<TileRecord>& tiles);
  /// Those that are not forgotten, ascending by id.
  const std::deque<TileRecord>& tiles() const { return tiles_; }
  /// The next tile's, and how many there are.
  int64_t next_id() const { return forgotten_ + static_cast<int64_t>(tiles_.size()); }
  /// Forgets the oldest tiles while more than `keep` are there, as far as their rounds are committed; those
  /// of the last such round stay. Rounds and all counts stay as they are.
  void forget(size_t keep);
  /// Tiles below this id are forgotten; all of them were committed.
  int64_t forgotten() const { return forgotten_; }
  /// Null if there is no such tile, or if it is forgotten.
  const TileRecord* find(TileId id) const;
  const std::vector<Round>& rounds() const { return rounds_; }
  /// First sample index that no round covers.
  int64_t planned_samples() const { return rounds_.empty() ? 0 : rounds_.back().end; }
  /// Largest s such that all rounds that end at or before s are committed.
  int64_t complete_samples() const { return complete_rounds_ > 0 ? rounds_[complete_rounds_ - 1].end : 0; }

  /// The pending tile of lowest id that `accept` takes.
  std::optional<TileId> next_pending(const std::function<bool(const TileRecord&)>& accept) const;
  const std::set<int64_t>& pending() const { return pending_; }  // their ids
  bool has_pending() const { return !pending_.empty(); }
  int64_t pending_count() const { return static_cast<int64_t>(pending_.size()); }
  int64_t leased_count() const { return static_cast<int64_t>(leased_.size()); }
  /// A lease that is good.
  struct Lease {
    TileId tile;
    int64_t attempt = 0;
    WorkerId worker;
    double since = 0, expires = 0;
    int pins = 0;
  };
  /// True if `worker` holds the tile with this attempt.
  bool holds(TileId id, const WorkerId& worker, int64_t attempt) const;
  /// How many workers hold a tile, and whether this one does.
  int workers() const { return static_cast<int>(holders_.size()); }
  bool has_worker(const WorkerId& worker) const { return holders_.contains(worker); }
  /// All leases, by tile and attempt. A tile that is raced for has two.
  std::vector<Lease> leases() const;
  /// Of a lease that is good.
  double leased_since(TileId id, int64_t attempt) const { return leases_.at({id.value, attempt}).since; }
  /// The leases of one tile.
  std::vector<Lease> leases_of(TileId id) const;

  /// What the tile's row becomes by a lease: attempt + 1. A leased tile may be leased once more (TileRecord).
  TileRecord leased_to(TileId id, const WorkerId& worker) const;
  /// What it becomes when this lease ends without a commit.
  TileRecord released(TileId id, int64_t attempt, bool failed) const;
  /// What it becomes by a commit under this lease; others of the tile end by that.
  TileRecord committed(TileId id, int64_t attempt, const std::string& digest) const;
  /// Replaces the row; leases that it does not name any more end. `since` and `expires` count for a lease
  /// that is new, in seconds of the clock.
  void apply(const TileRecord& record, double expires = 0, double since = 0);
  /// A pending tile of the last round in two parts or more; its cells must be those of `parts` together.
  struct Split {
    TileRecord smaller;
    std::vector<TileRecord> others;
  };
  bool may_split(TileId id) const;
  Split split(TileId id, const std::vector<CellRect>& parts) const;
  void apply(const Split& split);
  /// Moves the expiry of a lease.
  void renew(TileId id, int64_t attempt, double expires);
  /// Holds a lease while a commit under it is in progress: it does not expire before as many unpins.
  void pin(TileId id, int64_t attempt);
  void unpin(TileId id, int64_t attempt);
  /// Leases whose time is over, by tile and attempt. Takes the time of those whose first or renewed time has
  /// come since the last call, however many there are.
  std::vector<Lease> expired(double now);

 private:
  static constexpr size_t kNoRound = SIZE_MAX;
  using Key = std::pair<int64_t, int64_t>;  // tile, attempt
  Lease* find_lease(TileId id, int64_t attempt);
  void end_lease(std::map<Key, Lease>::iterator lease);
  /// Only those of the leases that there are.
  void rebuild_expiries();
  /// Leases of a row that begin or have ended.
  void follow(const TileRecord& record, double expires, double since);

  void count_complete_rounds();
  size_t index(TileId id) const { return static_cast<size_t>(id.value - forgotten_); }

  int64_t forgotten_ = 0;
  std::deque<TileRecord> tiles_;  // index = id - forgotten_
  std::vector<Round> rounds_;
  size_t complete_rounds_ = 0;   // so many, from the first one, are committed
  std::deque<size_t> round_of_;  // per tile; kNoRound: the pilot
  std::set<int64_t> pending_, leased_;
  std::map<Key, Lease> leases_;
  std::map<WorkerId, int> holders_;  // leases held, above 0
  /// A heap, the earliest first: of every lease one time at which or after which it expires. A renewed one is
  /// found out when that time has come; of those that ended some are left.
  std::vector<std::pair<double, Key>> expiries_;
};

}  // namespace lightmill
