#pragma once
// Mends films that the disk has damaged. The film is built again from the partials that the store still has,
// or from its snapshot where a partial is what is damaged. A tile that is in neither is rendered again. Sums
// are exact, so the image has the same bits as without the damage.
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "coordinator/core/farm_state.h"
#include "coordinator/core/job_table.h"
#include "coordinator/core/leases.h"

namespace lightmill {

class FilmRepair {
 public:
  FilmRepair(FarmState& farm, JobTable& jobs, Leases& leases) : farm_(farm), jobs_(jobs), leases_(leases) {}

  /// Repairs the jobs that StorageGuard found damaged twice. Wants FarmState::mutex not held.
  void repair_damaged();

 private:
  /// What the store still has.
  struct Salvage {
    std::unique_ptr<Merger::Layers> layers;
    JobRecord totals;              // of what is in `layers`
    std::vector<TileRecord> lost;  // committed, and not in `layers`
    bool has_snapshot = false;     // in `layers`: not all of it is in partials
  };
  void repair(const JobId& id, JobRecord record, const std::string& why);
  Salvage salvage(const JobRecord& record) const;
  Salvage from_partials(const JobRecord& record, const std::vector<TileRecord>& ledger,
                        const std::set<TileId>& kept) const;
  /// The snapshot, and the good ones of the partials that came later. Throws Error if the snapshot is not
  /// right.
  Salvage from_snapshot(const JobRecord& record, std::vector<TileRecord> ledger,
                        const std::set<TileId>& kept) const;
  void keep_damaged(const JobId& id, const std::string& why) const;
  void render_again(const JobId& id, Salvage salvage, const std::string& why);

  FarmState& farm_;
  JobTable& jobs_;
  Leases& leases_;
};

}  // namespace lightmill
