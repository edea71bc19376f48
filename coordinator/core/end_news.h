#pragma once
// Jobs and sequences that ended, and of which the hooks were not told yet (coordinator/hooks/). The store
// keeps it with their rows: an end is told after a crash, too. A frame's end is no news; its sequence's is.
//
// The caller must not hold FarmState::mutex.
#include <cstddef>
#include <vector>

#include "coordinator/core/farm_report.h"
#include "coordinator/core/farm_state.h"
#include "coordinator/core/job_table.h"

namespace lightmill {

class EndNews {
 public:
  EndNews(FarmState& farm, JobTable& jobs) : farm_(farm), jobs_(jobs) {}

  /// At most so many, those submitted first before the others.
  std::vector<EndNote> untold(size_t most) const;
  /// They were told of this end; a later one is still to be told.
  void told(const EndNote& note);

 private:
  FarmState& farm_;
  JobTable& jobs_;
};

}  // namespace lightmill
