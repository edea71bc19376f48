#pragma once
// Progress of a sequence on stderr: a bar on a terminal, plain lines otherwise, nothing when quiet.
#include <chrono>
#include <string>

#include "common/farm/sequence_types.h"

namespace lightmill::client {

/// "12 of 100 frames  34 %  1.31 Msamples/s  relMSE 0.0123, at most 0.05  ETA 12 min  3 workers"; parts that
/// are not known yet are left out.
std::string sequence_line(const SequenceStatus& status);

class SequenceProgress {
 public:
  explicit SequenceProgress(bool quiet);
  /// Shows the status if enough time has passed since the last one, or if its state changed.
  void update(const SequenceStatus& status);
  /// Shows the last status, and leaves the cursor on a fresh line.
  void finish(const SequenceStatus& status);

 private:
  void draw(const SequenceStatus& status);
  bool quiet_, terminal_;
  bool drawn_ = false;
  std::string last_, last_message_;
  JobState last_state_ = JobState::kQueued;
  std::chrono::steady_clock::time_point last_time_;
};

}  // namespace lightmill::client
