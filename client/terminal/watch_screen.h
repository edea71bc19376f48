#pragma once
// lightmill watch on a terminal: a screen of a few lines that is drawn over itself.
#include <chrono>
#include <string>
#include <vector>

#include "coordinator/core/farm.h"

namespace lightmill::client {

/// What the screen shows, a string a line, none of more than `columns` characters (colours aside): the job, a
/// bar, samples and speed, the error against its target, tiles, and up to `rows` lines in all with the
/// workers that render, fastest first.
std::vector<std::string> watch_lines(const JobStatus& status, const std::vector<WorkerStatus>& workers,
                                     int columns, int rows, bool colour);

class WatchScreen {
 public:
  /// Draws on stderr, which must be a terminal.
  void update(const JobStatus& status, const std::vector<WorkerStatus>& workers);

 private:
  size_t drawn_ = 0;  // lines on the screen
};

}  // namespace lightmill::client
