#pragma once
// What one worker did in the last hour: for which job it held a tile, and when it held none. Pure: time is an
// argument.
//
// The hour is cut into cells of ten seconds. A cell belongs to the job that had most of it; neighbouring
// cells of one job are one span. So there are at most 360 spans, however many tiles there were.
#include <cstdint>
#include <deque>
#include <vector>

#include "common/base/ids.h"

namespace lightmill {

class WorkerActivity {
 public:
  static constexpr double kCellSeconds = 10;
  static constexpr int64_t kCells = 360;  // that are remembered

  struct Span {
    JobId job;
    int64_t cell = 0, cells = 0;  // from clock time cell * kCellSeconds on
    double busy_seconds = 0;      // that the worker held tiles, of this job or others
    int64_t tiles = 0;            // that it delivered
  };

  /// The worker is there from `now` on.
  explicit WorkerActivity(double now = 0) : joined_(now), time_(now), cell_(cell_of(now)) {}
  /// A lease of the job begins, or ends. The one that began first counts as what the worker is at.
  void begin(const JobId& job, double now);
  void end(const JobId& job, bool delivered, double now);

  /// Of the last hour, oldest first; those that end after the cell `since`.
  std::vector<Span> spans(double now, int64_t since = INT64_MIN);
  /// Seconds of the last hour that it was there, and that it held a tile.
  double present_seconds(double now) const;
  double busy_seconds(double now);
  static int64_t cell_of(double now);

 private:
  static constexpr size_t kMostJobsOfCell = 8;  // what further ones did counts as of the last
  struct Part {
    JobId job;
    double busy_seconds = 0;
    int64_t tiles = 0;
  };
  void advance(double now);
  void close_cell();
  Part& part(const JobId& job);
  /// The present cell, as it would be closed.
  Span present() const;

  double joined_, time_;     // all before `time_` is counted
  std::vector<JobId> held_;  // of present leases, oldest first
  int64_t cell_;             // the present one
  std::vector<Part> parts_;  // of it
  std::deque<Span> spans_;   // of earlier ones
};

}  // namespace lightmill
