#pragma once
// Spot checks of one job: some committed tiles are rendered once more by other workers, and the results are
// compared. If they differ, the tile goes to a third worker; two against one decide. Pure.
//
// To a worker a check's lease is like any other. Its attempts go on from the tile's. They are not stored: a
// check that a restart interrupts begins anew.
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "coordinator/farm/lease_table.h"

namespace lightmill {

class CheckTable {
 public:
  struct Vote {
    WorkerId worker;
    std::string digest;  // of its result
  };
  /// The result of a vote.
  struct Outcome {
    bool decided = false;        // the check is over
    bool first_is_right = true;  // then: the committed result stands
    std::optional<WorkerId> liar;
    bool hopeless = false;  // three workers had three results
  };

  /// Begins a check of a committed tile.
  void add(const TileRecord& tile);
  void remove(TileId tile) { checks_.erase(tile); }
  /// The worker's results count no more: its votes about others' tiles and its leases go.
  void forget(const WorkerId& worker);
  bool empty() const { return checks_.empty(); }
  /// The tiles under check, in their order. The first vote of each is the committer's.
  std::vector<TileId> tiles() const;
  const std::vector<Vote>& votes(TileId tile) const { return checks_.at(tile).votes; }
  bool contains(TileId tile) const { return checks_.contains(tile); }
  /// The highest attempt that was leased of the tile.
  int64_t attempts(TileId tile) const { return checks_.at(tile).attempts; }

  /// The first tile that nobody checks at present and that this worker may check.
  std::optional<TileId> next(const WorkerId& worker) const;
  /// Returns the attempt.
  int64_t lease(TileId tile, const WorkerId& worker, double expires);
  bool holds(TileId tile, const WorkerId& worker, int64_t attempt) const;
  void renew(TileId tile, double expires);
  void pin(TileId tile);
  void unpin(TileId tile);
  void release(TileId tile);
  /// Valid leases; those of them that have expired.
  std::vector<LeaseTable::Lease> leases() const;
  std::vector<LeaseTable::Lease> expired(double now) const;

  /// The holder of the tile's check rendered `digest`. Its lease ends.
  Outcome vote(TileId tile, const std::string& digest);

 private:
  struct Check {
    std::vector<Vote> votes;
    int64_t attempts = 0;
    std::optional<LeaseTable::Lease> lease;
  };
  std::map<TileId, Check> checks_;
};

}  // namespace lightmill
