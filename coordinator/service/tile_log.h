#pragma once
// The history of tiles: to which worker each was leased, how each attempt ended and why. Kept in memory, the
// newest lines over all jobs, for `lightmill logs`. Thread-safe.
//
//   const LogScope scope({"j1", 3, 2, "w4"});
//   log.add("committed: 35 kB");
//   log.of(JobId{"j1"}, TileId{3}, 100);
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/base/ids.h"
#include "common/base/log.h"
#include "common/farm/farm_types.h"

namespace lightmill {

/// What lines about a lease are about.
LogContext log_context(const WorkerId& worker, const LeaseKey& key);

class TileLog {
 public:
  static constexpr size_t kMaxLines = 20000;
  static constexpr size_t kMaxTextBytes = 500;

  struct Line {
    double time = 0;  // seconds since 1970
    LogContext about;
    std::string text;
  };

  /// Adds a line about the job of the thread's LogScope; without a job it is not kept. A long text is cut.
  /// Beyond kMaxLines the oldest line goes.
  void add(std::string text);
  /// The newest lines about a job, or about one of its tiles, oldest first; at most `most`.
  std::vector<Line> of(const JobId& job, const std::optional<TileId>& tile, size_t most) const;

 private:
  mutable std::mutex mutex_;
  std::deque<Line> lines_;
};

}  // namespace lightmill
