#pragma once
// Budgets of sequences: processor time for all frames together, spent where the error falls most.
//
// First every frame is rendered to kFirstSamples, which gives it a picture and an estimate of its error. Then
// samples are doubled, frame by frame. Doubling costs what the frame has cost so far (t) and halves its error
// (e), so the frame with the largest e/t comes next. It goes on while the budget has room for the next step.
// What a frame ends with is a number of samples, and so its bits are those of the same frame alone.
#include <mutex>
#include <set>

#include "common/farm/sequence_types.h"
#include "coordinator/core/farm_state.h"
#include "coordinator/core/job_desk.h"
#include "coordinator/core/job_table.h"

namespace lightmill {

class BudgetKeeper {
 public:
  /// Enough for an estimate with its interval.
  static constexpr int64_t kFirstSamples = 64;

  /// Finds the sequences that the store has.
  BudgetKeeper(FarmState& farm, JobTable& jobs, JobDesk& desk);
  /// Gives more samples to frames of sequences whose budgets allow it, so that there is work for all workers.
  /// The caller must not hold FarmState::mutex.
  void spend();

 private:
  // FarmState::mutex held:
  void spend(Sequence& sequence, double now);
  /// The frame whose error falls most for its time, of those that are done and cost at most `left` more
  /// seconds; null: there is none.
  static Job* next_frame(const Sequence& sequence, double left);

  FarmState& farm_;
  JobTable& jobs_;
  JobDesk& desk_;
};

}  // namespace lightmill
