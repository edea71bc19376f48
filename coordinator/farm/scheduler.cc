#include "coordinator/farm/scheduler.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "coordinator/farm/job_progress.h"
#include "coordinator/farm/sharing/deadlines.h"
#include "coordinator/farm/sharing/film_bytes.h"

namespace lightmill {
namespace {

constexpr int kRunTiles = 8;  // that a worker gets of a job before another one's turn
// Whoever idles races those who are late. In a farm that never idles they are raced once they are as many
// times as late.
constexpr double kIdlePatience = 1, kBusyPatience = 4;
// So many workers that have delivered something are believed; of others so many in the end.
constexpr size_t kProvenReports = 2, kManyReports = 64;

constexpr double kNoDeadline = std::numeric_limits<double>::infinity();
/// Frames of a sequence that are looked at to find the next one: more than one only if jobs or workers
/// differ.
constexpr int kMostLooks = 64;

/// A tile may be leased: in time, or one of the first round, without which the picture has holes.
bool in_time(const TileRecord& tile, bool is_up) { return !is_up || tile.tile.sample_begin == 0; }

}  // namespace

Job& Scheduler::add(Job job) {
  Job& added = jobs.add(std::move(job));
  state_changed(added);
  return added;
}

void Scheduler::state_changed(Job& job) {
  if (is_final(job.record.state)) withdraw(job);
  jobs.place(job);
  Sequence* const sequence = jobs.sequence_of(job);
  if (sequence && sequence->not_final.empty()) withdraw(*sequence);
}

void Scheduler::withdraw(Job& job) {
  shares_.settle_all(job.record, &share_of(job));
  admission_.leave(job.record.id);
  if (!job.record.frame) compete(job, false);
}

void Scheduler::withdraw(Sequence& sequence) {
  if (sequence.frames.empty()) return;
  shares_.leave(sequence.frames.begin()->second.job->record, &sequence.share);
}

JobShare& Scheduler::share_of(Job& job) {
  Sequence* const sequence = jobs.sequence_of(job);
  return sequence ? sequence->share : job.share;
}
const JobShare& Scheduler::share_of(const Job& job) const {
  const Sequence* const sequence = jobs.sequence_of(job);
  return sequence ? sequence->share : job.share;
}

bool Scheduler::wants_workers(const Job& job) const { return is_runnable(job) && !jobs.waits_for(job); }

void Scheduler::compete(Job& job, bool wants) {
  if (wants) {
    shares_.join(job.record, &job.share);
  } else {
    shares_.leave(job.record, &job.share);
    admission_.leave(job.record.id);
  }
}

FilmAdmission::Claim Scheduler::claim(const Job& job) const {
  return {job.record.priority, shares_.submitter_served(job.record), share_of(job).served,
          film_bytes(job.record.settings)};
}

void Scheduler::add_single(Job& job, const Worker& worker, std::vector<Candidate>* fitting) {
  const bool wants = wants_workers(job);
  if (wants != job.share.competes) compete(job, wants);
  if (!wants || !fits(job, worker) || job.unable.contains(worker.id)) return;
  const int most = job.record.max_workers;
  if (most > 0 && job.tiles.workers() >= most && !job.tiles.has_worker(worker.id)) return;
  fitting->push_back({{}, &job});
}

void Scheduler::add_frames(Sequence& sequence, const Worker& worker, std::vector<Candidate>* fitting) {
  bool wants = false;
  const auto suits = [&](const Job& frame) {
    if (!wants_workers(frame)) return false;
    wants = true;
    return fits(frame, worker) && !frame.unable.contains(worker.id);
  };
  std::vector<Job*> found;
  for (const auto& [turn, frame] : sequence.open) {
    if (suits(*frame)) found.push_back(frame);
  }
  int looks = 0;
  for (const auto& [turn, frame] : sequence.waiting) {
    if (++looks > kMostLooks) break;
    if (!suits(*frame)) continue;
    found.push_back(frame);
    break;
  }
  if (wants != sequence.share.competes) {
    const JobRecord& any = sequence.frames.begin()->second.job->record;
    wants ? shares_.join(any, &sequence.share) : shares_.leave(any, &sequence.share);
  }
  const int most = sequence.record.request.max_workers;
  if (most > 0 && sequence.workers() >= most && !sequence.has_worker(worker.id)) return;
  for (Job* frame : found) fitting->push_back({{}, frame});
}

double Scheduler::late_deadline(Job& job, double now) {
  if (job.record.deadline <= 0) return kNoDeadline;
  const double due = job.record.deadline - options_.unix_offset;
  Sequence* const sequence = jobs.sequence_of(job);
  const Punctuality& p = sequence ? look_at_deadline(*sequence, due, now) : look_at_deadline(job, due, now);
  return p.late ? due : kNoDeadline;
}

std::string Scheduler::deadline_note(const Job& job, double now) const {
  if (job.record.deadline <= 0 || is_final(job.record.state)) return {};
  const double passed = now - (job.record.deadline - options_.unix_offset);
  if (passed > 0) return "its deadline has passed";
  const Sequence* const sequence = jobs.sequence_of(job);
  const Punctuality& p = sequence ? sequence->punctuality : job.punctuality;
  if (p.seconds_late < 60) return {};
  return "expected about " + std::to_string(std::lround(p.seconds_late / 60)) + " min after its deadline";
}

std::vector<Job*> Scheduler::candidates(const Worker& worker, double now) {
  // Of a submitter's jobs those that will miss their deadline come first, then those that nobody works for
  // yet; of equals the older one. The frames of a sequence stand together, in the order of their turns.
  std::vector<Candidate> fitting;
  for (const auto& [rank, job] : jobs.singles()) add_single(*job, worker, &fitting);
  for (const auto& [id, sequence] : jobs.live()) add_frames(*sequence, worker, &fitting);
  for (auto& [key, job] : fitting) {  // once all compete that do: who joins begins level with the others
    const JobShare& share = share_of(*job);
    key = {-int64_t{job->record.priority}, *share.submitters, late_deadline(*job, now), jobs.begun(*job),
           share.served};
  }
  std::stable_sort(fitting.begin(), fitting.end(),
                   [](const Candidate& a, const Candidate& b) { return a.key < b.key; });
  std::vector<Job*> ordered;
  for (const Candidate& candidate : fitting) ordered.push_back(candidate.job);
  if (worker.run_left > 0 && !ordered.empty()) {
    const int top = ordered.front()->record.priority;
    const auto same = std::find_if(ordered.begin(), ordered.end(), [&](const Job* job) {
      return job->record.id == worker.last_job && job->record.priority == top;
    });
    // It goes on where it is, after those that are late and those that nobody works for yet.
    const auto first_begun = std::find_if(ordered.begin(), ordered.end(), [&](Job* job) {
      return jobs.begun(*job) && late_deadline(*job, now) == kNoDeadline;
    });
    if (same != ordered.end() && first_begun < same) std::rotate(first_begun, same, same + 1);
  }
  return ordered;
}

Offer Scheduler::offer_of(const Job& job, const Worker& worker, double now) const {
  const WorkerId& worker_id = worker.id;
  if (const auto tile = job.checks.next(worker_id)) return CheckOffer{job.record.id, *tile};
  const bool up = time_is_up(job, now);
  // A tile that failed here goes to somebody else, if there is anybody else who has not failed it too.
  const auto acceptable = [&](const TileRecord& tile) {
    if (!in_time(tile, up)) return false;
    if (tile.failures == 0 || !job.failed_on.contains({tile.id, worker_id})) return true;
    for (const auto& [id, other] : workers.all()) {
      if (workers.may_work(other, now) && fits(job, other) && !job.failed_on.contains({tile.id, id})) {
        return false;
      }
    }
    return true;
  };
  if (const auto tile = job.tiles.next_pending(acceptable)) {
    std::vector<CellRect> parts = tail_.parts_for_idle(job, *tile, worker, now);
    if (!parts.empty()) return SplitOffer{job.record.id, *tile, std::move(parts)};
    return LeaseOffer{job.record.id, *tile};
  }
  std::vector<TileSpec> round = rounds_.next_round(job, now);
  if (!round.empty()) return RoundOffer{job.record.id, std::move(round)};
  if (const auto late = tail_.tile_to_race(job, worker, now, kBusyPatience))
    return LeaseOffer{job.record.id, *late};
  return {};
}

bool Scheduler::is_believed(const Job& job, TileId tile, double now) const {
  size_t reports = 0, proven = 0;
  bool another_could = false;
  for (const auto& [id, worker] : workers.all()) {
    const bool reported = job.unable.contains(id) || job.failed_on.contains({tile, id});
    reports += reported;
    proven += reported && WorkerTable::is_proven(worker);
    another_could = another_could || (!reported && workers.may_work(worker, now) && fits(job, worker));
  }
  return !another_could || proven >= kProvenReports || reports >= kManyReports;
}

Offer Scheduler::offer(const WorkerId& worker_id, double now) {
  const Worker* worker = workers.find(worker_id);
  if (!worker || !workers.may_work(*worker, now)) return {};
  if (worker->leases >= WorkerTable::most_leases(*worker)) return {};
  const std::vector<Job*> jobs = candidates(*worker, now);
  bool claims_are_new = false;
  const auto may_take = [&](const Job& job) {
    if (!claims_are_new) {  // mostly the first job is admitted already, and nobody asks
      for (const Job* other : jobs) admission_.update(other->record.id, claim(*other));
      claims_are_new = true;
    }
    return admission_.may_take(job.record.id, claim(job), now);
  };
  for (const bool admitted : {true, false}) {  // rather a film from the disk than an idle worker
    for (Job* job : jobs) {
      const JobId& id = job->record.id;
      const bool is_admitted = admission_.admitted(id);
      if (admitted ? !is_admitted && !may_take(*job) : is_admitted) continue;
      Offer found = offer_of(*job, *worker, now);
      if (std::holds_alternative<std::monostate>(found)) continue;
      if (admitted && !is_admitted) admission_.take(id, claim(*job), now);
      return found;
    }
  }
  for (const Job* job : jobs) {
    if (const auto tile = tail_.tile_to_race(*job, *worker, now, kIdlePatience))
      return LeaseOffer{job->record.id, *tile};
  }
  return {};
}

void Scheduler::granted(Job& job, const TileRecord& tile) {
  Worker& worker = *workers.find(tile.worker);
  const JobRecord& record = job.record;
  if (worker.last_job == record.id && worker.run_left > 0) {
    --worker.run_left;
  } else {
    worker.last_job = record.id;
    worker.run_left = kRunTiles - 1;
  }
  double seconds = options_.target_tile_seconds * worker.registration.threads;
  if (!is_pilot(tile.tile) && record.pixel_samples > 0 && record.cpu_seconds > 0) {
    const int64_t samples = record.settings.grid.pixels(tile.tile.cells).area() * tile.tile.samples();
    seconds = record.cpu_seconds * static_cast<double>(samples) / static_cast<double>(record.pixel_samples);
  }
  shares_.charge(record, &share_of(job), tile.id, tile.attempt, seconds);
  if (Sequence* sequence = jobs.sequence_of(job)) sequence->opened(job);
}

void Scheduler::settled(Job& job, TileId tile, int64_t attempt, double seconds) {
  shares_.settle(job.record, &share_of(job), tile, attempt, seconds);
}

bool Scheduler::complete(const Job& job, double now) const {
  return job.checks.empty() && job.liars.empty() && rendered(job, now);
}

bool Scheduler::has_checker(const Job& job, TileId tile, double now) const {
  const std::vector<CheckTable::Vote>& votes = job.checks.votes(tile);
  for (const auto& entry : workers.all()) {
    const WorkerId& id = entry.first;
    const Worker& worker = entry.second;
    if (worker.draining || workers.is_lost(worker, now) || !fits(job, worker)) continue;
    const auto is_own = [&](const CheckTable::Vote& v) { return v.worker == id; };
    if (std::none_of(votes.begin(), votes.end(), is_own)) return true;
  }
  return false;
}

bool Scheduler::rendered(const Job& job, double now) const {
  if (is_final(job.record.state) || job.tiles.leased_count() > 0 || job.tiles.rounds().empty()) return false;
  const bool up = time_is_up(job, now);
  if (job.tiles.next_pending([&](const TileRecord& tile) { return in_time(tile, up); })) return false;
  return rounds_.next_round(job, now).empty();
}

}  // namespace lightmill
