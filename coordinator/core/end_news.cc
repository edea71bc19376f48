#include "coordinator/core/end_news.h"

#include <algorithm>
#include <mutex>
#include <utility>

namespace lightmill {

std::vector<EndNote> EndNews::untold(size_t most) const {
  const std::lock_guard lock(farm_.mutex);
  std::vector<EndNote> notes;
  for (const auto& [rank, job] : farm_.scheduler.jobs.untold()) {
    if (notes.size() >= most) return notes;
    notes.push_back({job->record.id.value, job->record.ends.count});
  }
  for (const SequenceId& id : farm_.scheduler.jobs.sequences()) {
    if (notes.size() >= most) return notes;
    const Sequence& sequence = *farm_.scheduler.jobs.find(id);
    if (sequence.record.ends.untold() && has_ended(sequence))
      notes.push_back({id.value, sequence.record.ends.count});
  }
  return notes;
}

void EndNews::told(const EndNote& note) {
  const std::lock_guard lock(farm_.mutex);
  const auto up_to = [&](Ends ends) { return std::max(ends.told, std::min(note.count, ends.count)); };
  if (is_sequence_id(note.id)) {
    Sequence& sequence = jobs_.get(SequenceId{note.id});
    SequenceRecord record = sequence.record;
    record.ends.told = up_to(record.ends);
    farm_.store->save_sequence(record);
    sequence.record = std::move(record);
    return;
  }
  Job& job = jobs_.get(JobId{note.id});
  JobRecord record = JobTable::record_at(job, farm_.clock.now());
  record.ends.told = up_to(record.ends);
  jobs_.update(job, std::move(record), farm_.clock.now());
}

}  // namespace lightmill
