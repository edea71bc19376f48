#pragma once
// All jobs and sequences, in the order of their submission, and those among them that have not ended. Pure.
#include <cstddef>
#include <map>
#include <vector>

#include "coordinator/farm/job.h"
#include "coordinator/farm/sequence.h"

namespace lightmill {

class JobIndex {
 public:
  JobIndex() = default;
  JobIndex(const JobIndex&) = delete;
  JobIndex& operator=(const JobIndex&) = delete;

  Job& add(Job job);
  Sequence& add(SequenceRecord record);
  // Null if there is none.
  Job* find(const JobId& id);
  const Job* find(const JobId& id) const;
  Sequence* find(const SequenceId& id);
  const Sequence* find(const SequenceId& id) const;
  /// That the job is a frame of; null: of none.
  Sequence* sequence_of(const Job& job);
  const Sequence* sequence_of(const Job& job) const;
  /// To be called after record.state, or what else is_runnable() goes by, was changed.
  void place(Job& job);

  // In the order of submission.
  const std::vector<JobId>& order() const { return order_; }
  const std::vector<SequenceId>& sequences() const { return sequence_order_; }

  // Of those that are not final, in the order of submission:
  std::vector<JobId> active() const;
  std::vector<Job*> active_jobs() const;
  /// Those that are no frames.
  const std::map<size_t, Job*>& singles() const { return singles_; }
  /// Sequences with frames that are not final.
  const std::map<SequenceId, Sequence*>& live() const { return live_; }
  /// Final ones that are no frames and whose end was not told, in the order of submission.
  const std::map<size_t, Job*>& untold() const { return untold_; }
  /// Those that may have leases or be complete: of a sequence those that somebody works on, and the next one.
  std::vector<Job*> in_work() const;
  /// Jobs and sequences; the frames of a sequence count as one.
  size_t open_count() const { return singles_.size() + live_.size(); }

  /// Somebody works for it, or has worked; of a frame: for its sequence.
  bool begun(const Job& job) const;
  /// Whether a worker that asks may get this frame of a sequence: it is open, or the next.
  bool is_next(const Job& frame) const;
  /// The first job that this one has to wait for, of a sequence its first frame; null: none.
  const Job* waits_for(const Job& job) const;

 private:
  std::map<JobId, Job> jobs_;
  std::vector<JobId> order_;
  std::map<JobId, size_t> rank_;   // place in order_, from 1
  std::map<size_t, Job*> active_;  // these by rank
  std::map<size_t, Job*> singles_;
  std::map<size_t, Job*> untold_;
  std::map<SequenceId, Sequence> sequences_;
  std::vector<SequenceId> sequence_order_;
  std::map<SequenceId, Sequence*> live_;
};

}  // namespace lightmill
