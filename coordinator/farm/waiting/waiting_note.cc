#include "coordinator/farm/waiting/waiting_note.h"

#include <algorithm>
#include <vector>

#include "coordinator/farm/job_progress.h"

namespace lightmill {
namespace {

std::string note_of_earlier_job(const Job& earlier) {
  const JobState state = earlier.record.state;
  const std::string name = "job " + earlier.record.id.value;
  if (!is_final(state)) return "waits for " + name + ", which is " + job_state_name(state);
  return "blocked: it comes after " + name + ", which " +
         (state == JobState::kFailed ? "failed" : "was cancelled") + "; retry that one, or cancel this one";
}

/// Of a tile that two workers rendered differently; empty: there is none.
std::string note_of_checks(const CheckTable& checks) {
  for (const TileId& tile : checks.tiles()) {
    const std::vector<CheckTable::Vote>& votes = checks.votes(tile);
    if (votes.size() < 2) continue;
    return "workers " + votes[0].worker.value + " and " + votes[1].worker.value + " rendered tile " +
           std::to_string(tile.value) + " differently: a third one has to decide";
  }
  return {};
}

/// Why no worker takes the job; empty: some could.
std::string note_of_workers(const WorkerTable& workers, const Job& job, double now) {
  int live = 0, pool = 0, present = 0, benched = 0;
  for (const auto& [id, worker] : workers.all()) {
    if (workers.is_lost(worker, now)) continue;
    ++present;
    benched += now < worker.benched_until;
    if (!workers.may_work(worker, now)) continue;
    ++live;
    if (job.record.pool.empty() || job.record.pool == worker.registration.pool) ++pool;
  }
  const std::string turned_away = workers.refusals(now);
  const std::string refused = turned_away.empty() ? "" : "; " + turned_away;
  if (live == 0 && benched > 0) {
    return "waits for a worker: of " + std::to_string(present) + " connected " + std::to_string(benched) +
           " rest after failures" + refused;
  }
  if (live == 0 && present > 0) return "waits for a worker: those connected are being drained" + refused;
  if (live == 0) return "waits for a worker: none is connected" + refused;
  if (pool == 0) return "waits for a worker of pool \"" + job.record.pool + "\"" + refused;
  if (fitting_workers(workers, job, now) == 0 && job.least_memory > 0) {
    return "waits for a worker with more than " + std::to_string(job.least_memory >> 20) +
           " MiB of memory, with which others ran out of it" + refused;
  }
  if (fitting_workers(workers, job, now) == 0) {
    return "waits for a worker of arithmetic class " + job.record.arithmetic_class.substr(0, 12) +
           "; those connected compute other bits" + refused;
  }
  return {};
}

/// Until the jobs are done that this one has to wait for; -1 if that is not known of one.
double seconds_until_earlier_end(const JobIndex& jobs, const Job& job, double now) {
  double longest = 0;
  for (const JobId& id : job.record.after) {
    double seconds = 0;
    if (const Sequence* sequence = jobs.find(SequenceId{id.value})) {
      seconds = eta_seconds(*sequence, now);
    } else if (const Job* earlier = jobs.find(id)) {
      const JobState state = earlier->record.state;
      const bool goes_on = state == JobState::kRunning && is_runnable(*earlier);
      seconds = state == JobState::kDone ? 0 : goes_on ? seconds_left(*earlier, now) : -1;
    }
    if (seconds < 0) return -1;
    longest = std::max(longest, seconds);
  }
  return longest;
}

/// A live worker that the job could have; null: none.
const Worker* some_worker(const WorkerTable& workers, const Job& job, double now) {
  for (const auto& [id, worker] : workers.all()) {
    if (workers.may_work(worker, now) && fits(job, worker) && !job.unable.contains(id)) return &worker;
  }
  return nullptr;
}

/// A job that shares the workers has none now and then: that is no news while its tiles keep coming.
bool gets_on(const Job& job, double now) {
  constexpr double kPatienceSeconds = 10;
  return !job.recent.empty() && now - job.recent.back().first < kPatienceSeconds;
}

}  // namespace

WaitingNote waiting_note(const Scheduler& scheduler, Turns& turns, const Job& job, double now) {
  if (!is_runnable(job)) return {};
  if (const Job* earlier = scheduler.jobs.waits_for(job)) {
    return {note_of_earlier_job(*earlier), earlier->record.id,
            seconds_until_earlier_end(scheduler.jobs, job, now)};
  }
  if (job.record.frame && job.record.state == JobState::kQueued && !scheduler.jobs.is_next(job)) {
    return {"waits for its turn in sequence " + job.record.frame->sequence.value, {}};
  }
  if (std::string note = note_of_checks(job.checks); !note.empty()) return {note, {}};
  if (job.tiles.leased_count() > 0) {
    return {needs_pilot(job.record.settings) ? "choosing strategies" : "", {}};
  }
  if (!job.checks.empty() && scheduler.rendered(job, now)) {
    return {"waits for spot checks of its tiles", {}};
  }
  const Worker* const worker = some_worker(scheduler.workers, job, now);
  if (!worker) return {note_of_workers(scheduler.workers, job, now), {}};
  return gets_on(job, now) ? WaitingNote{} : turns.note(scheduler, job, *worker, now);
}

}  // namespace lightmill
