#include "coordinator/farm/waiting/turns.h"

#include <limits>

namespace lightmill {
namespace {

/// "job j7", "sequence s3"
std::string name_of(const Job& job) {
  return job.record.frame ? "sequence " + job.record.frame->sequence.value : "job " + job.record.id.value;
}

/// What puts `first` before `second`: the first part of their keys that differs.
std::string reason(const Turn& first, const Turn& second) {
  const TurnKey &a = first.key, &b = second.key;
  if (a.negative_priority != b.negative_priority) {
    return "whose priority is higher (" + std::to_string(-a.negative_priority) + ", not " +
           std::to_string(-b.negative_priority) + ")";
  }
  if (a.submitter_served != b.submitter_served) {
    const std::string &whose = first.job->record.submitter, &own = second.job->record.submitter;
    return "whose submitter" + (whose.empty() ? "" : " " + whose) + " has had less of the workers' time" +
           (own.empty() ? "" : " than " + own);
  }
  if (a.late_deadline != b.late_deadline) return "which is late for its deadline";
  if (a.begun != b.begun) return "which nobody works for yet";
  if (a.served != b.served) return "which has had less of the workers' time";
  return "which was submitted earlier";
}

std::string others(size_t count) {
  if (count == 0) return {};
  return count == 1 ? "; one more is before it" : "; " + std::to_string(count) + " more are before it";
}

}  // namespace

const Turns::Line* Turns::line(const Scheduler& scheduler, const Worker& worker, double now) {
  std::erase_if(lines_, [&](const auto& item) { return now - item.second.made_at >= kKeptSeconds; });
  const auto found = lines_.find(worker.id);
  if (found != lines_.end()) return &found->second;
  if (lines_.size() >= kMostLines) return nullptr;
  Line& made = lines_[worker.id];
  made.made_at = now;
  made.turns = scheduler.turns(worker, now);
  made.estimates = estimate_turns(scheduler, made.turns, now);
  for (size_t i = 0; i < made.turns.size(); ++i) made.places[made.turns[i].job] = i;
  made.next = scheduler.next_served(made.turns, worker, now);
  return &made;
}

WaitingNote Turns::note(const Scheduler& scheduler, const Job& job, const Worker& worker, double now) {
  const Line* const all = line(scheduler, worker, now);
  if (!all || !all->next) return {};
  const auto place = all->places.find(&job);
  if (place == all->places.end()) {  // it has come, or what keeps it from the worker has gone, since
    const Sequence* const sequence = scheduler.jobs.sequence_of(job);
    const int most = sequence ? sequence->record.request.max_workers : job.record.max_workers;
    if (!sequence || most == 0 || sequence->workers() < most) return {};
    return {"its sequence has as many workers as it may have, " + std::to_string(most), {}};
  }
  if (all->next == &job) {
    if (worker.leases == 0 || job.record.state != JobState::kQueued) return {};
    return {"comes next, once a worker has finished its tile", {}};
  }
  const TurnEstimate& estimate = all->estimates[place->second];
  const size_t first = all->places.at(all->next);
  const std::string behind = "waits behind " + name_of(*all->next);
  if (first < place->second) {
    const size_t more = estimate.ahead - (estimate.ahead > 0 ? 1 : 0);
    return {behind + ", " + reason(all->turns[first], all->turns[place->second]) + others(more),
            all->next->record.id, estimate.seconds, estimate.end_seconds};
  }
  if (scheduler.has_room(job, now)) return {};  // it has nothing for a worker right now
  return {behind + ": the coordinator's memory has no room for another job's film (--film-memory)",
          all->next->record.id};
}

}  // namespace lightmill
