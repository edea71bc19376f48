#include "coordinator/farm/job_index.h"

#include <utility>

namespace lightmill {

Job& JobIndex::add(Job job) {
  const JobId id = job.record.id;
  order_.push_back(id);
  rank_[id] = order_.size();
  Job& added = jobs_.insert_or_assign(id, std::move(job)).first->second;
  if (Sequence* sequence = sequence_of(added)) sequence->add(added);
  return added;
}

Sequence& JobIndex::add(SequenceRecord record) {
  const SequenceId id = record.id;
  sequence_order_.push_back(id);
  return sequences_.emplace(id, std::move(record)).first->second;
}

Job* JobIndex::find(const JobId& id) {
  const auto found = jobs_.find(id);
  return found == jobs_.end() ? nullptr : &found->second;
}
const Job* JobIndex::find(const JobId& id) const { return const_cast<JobIndex*>(this)->find(id); }

Sequence* JobIndex::find(const SequenceId& id) {
  const auto found = sequences_.find(id);
  return found == sequences_.end() ? nullptr : &found->second;
}
const Sequence* JobIndex::find(const SequenceId& id) const { return const_cast<JobIndex*>(this)->find(id); }

Sequence* JobIndex::sequence_of(const Job& job) {
  return job.record.frame ? &sequences_.at(job.record.frame->sequence) : nullptr;
}
const Sequence* JobIndex::sequence_of(const Job& job) const {
  return const_cast<JobIndex*>(this)->sequence_of(job);
}

void JobIndex::place(Job& job) {
  const size_t rank = rank_.at(job.record.id);
  Sequence* const sequence = sequence_of(job);
  if (is_final(job.record.state)) {
    active_.erase(rank);
    singles_.erase(rank);
  } else {
    active_[rank] = &job;
    if (!sequence) singles_[rank] = &job;
  }
  if (!sequence && is_final(job.record.state) && job.record.ends.untold()) {
    untold_[rank] = &job;
  } else {
    untold_.erase(rank);
  }
  if (!sequence) return;
  sequence->place(job);
  if (sequence->not_final.empty()) {
    live_.erase(sequence->record.id);
  } else {
    live_[sequence->record.id] = sequence;
  }
}

std::vector<JobId> JobIndex::active() const {
  std::vector<JobId> ids;
  for (const auto& [rank, job] : active_) ids.push_back(job->record.id);
  return ids;
}

std::vector<Job*> JobIndex::active_jobs() const {
  std::vector<Job*> jobs;
  for (const auto& [rank, job] : active_) jobs.push_back(job);
  return jobs;
}

std::vector<Job*> JobIndex::in_work() const {
  std::vector<Job*> jobs;
  for (const auto& [rank, job] : singles_) jobs.push_back(job);
  for (const auto& [id, sequence] : live_) {
    for (const auto& [turn, frame] : sequence->open) jobs.push_back(frame);
    if (!sequence->waiting.empty()) jobs.push_back(sequence->waiting.begin()->second);
  }
  return jobs;
}

bool JobIndex::begun(const Job& job) const {
  if (const Sequence* sequence = sequence_of(job)) return sequence->begun;
  return job.record.state != JobState::kQueued || job.tiles.leased_count() > 0;
}

bool JobIndex::is_next(const Job& frame) const {
  const Sequence& sequence = *sequence_of(frame);
  const Sequence::Turn turn = sequence.frames.at(frame.record.frame->number).turn;
  return sequence.open.contains(turn) ||
         (!sequence.waiting.empty() && sequence.waiting.begin()->first == turn);
}

const Job* JobIndex::waits_for(const Job& job) const {
  if (job.record.state != JobState::kQueued) return nullptr;  // what has begun goes on
  for (const JobId& id : job.record.after) {
    const Job* earlier = find(id);
    if (const Sequence* sequence = find(SequenceId{id.value}))
      earlier = sequence->not_done.empty() ? nullptr : sequence->not_done.begin()->second;
    if (earlier && earlier->record.state != JobState::kDone) return earlier;
  }
  return nullptr;
}

}  // namespace lightmill
