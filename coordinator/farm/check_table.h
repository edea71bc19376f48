#pragma once
// Spot checks of one job: committed tiles that other workers render once more, and what came of it. A tile
// that came out differently goes to a third worker; two against one decide. Pure.
//
// A check's lease looks to a worker like any other. Its attempts go on from the tile's; they are not stored,
// as a check that a restart interrupts begins anew.
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
    std::string digest;  // of what it rendered
  };
  /// What a vote leads to.
  struct Outcome {
    bool decided = false;        // the check is over
    bool first_is_right = true;  // then: what was committed stands
    std::optional<WorkerId> liar;
    bool hopeless = false;  // three came to three results
  };

  /// A committed tile is to be checked.
  void add(const TileRecord& tile);
  void remove(TileId tile) { checks_.erase(tile); }
  /// The worker's word counts no more: its votes about others' tiles and its leases are gone.
  void forget(const WorkerId& worker);
  bool empty() const { return checks_.empty(); }
  /// In the order of tiles; the first vote of each is the committer's.
  std::vector<TileId> tiles() const;
  const std::vector<Vote>& votes(TileId tile) const { return checks_.at(tile).votes; }
  bool contains(TileId tile) const { return checks_.contains(tile); }
  /// The highest attempt that was given for the tile.
  int64_t attempts(TileId tile) const { return checks_.at(tile).attempts; }

  /// The first tile that nobody checks right now, and this worker may.
  std::optional<TileId> next(const WorkerId& worker) const;
  /// The attempt.
  int64_t lease(TileId tile, const WorkerId& worker, double expires);
  bool holds(TileId tile, const WorkerId& worker, int64_t attempt) const;
  void renew(TileId tile, double expires);
  void pin(TileId tile);
  void unpin(TileId tile);
  void release(TileId tile);
  /// Leases that are good; those of them whose time is over.
  std::vector<LeaseTable::Lease> leases() const;
  std::vector<LeaseTable::Lease> expired(double now) const;

  /// Whoever holds the tile's check rendered this. Its lease ends.
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
