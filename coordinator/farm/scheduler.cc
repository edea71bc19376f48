#include "coordinator/farm/scheduler.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

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

bool Scheduler::wants_workers(const Sequence& sequence) const {
  const auto wants = [&](const auto& item) { return wants_workers(*item.second); };
  if (std::any_of(sequence.open.begin(), sequence.open.end(), wants)) return true;
  int looks = 0;
  for (const auto& item : sequence.waiting) {
    if (++looks > kMostLooks) return false;
    if (wants(item)) return true;
  }
  return false;
}

void Scheduler::update_competing() {
  for (const auto& [rank, job] : jobs.singles()) {
    const bool wants = wants_workers(*job);
    if (wants != job->share.competes) compete(*job, wants);
  }
  for (const auto& [id, sequence] : jobs.live()) {
    const bool wants = wants_workers(*sequence);
    if (wants == sequence->share.competes) continue;
    const JobRecord& any = sequence->frames.begin()->second.job->record;
    wants ? shares_.join(any, &sequence->share) : shares_.leave(any, &sequence->share);
  }
}

void Scheduler::add_single(const Job& job, const Worker& worker, std::vector<Turn>* fitting) const {
  if (!wants_workers(job) || !fits(job, worker) || job.unable.contains(worker.id)) return;
  const int most = job.record.max_workers;
  if (most > 0 && job.tiles.workers() >= most && !job.tiles.has_worker(worker.id)) return;
  fitting->push_back({{}, &job});
}

void Scheduler::add_frames(const Sequence& sequence, const Worker& worker, std::vector<Turn>* fitting) const {
  const auto suits = [&](const Job& frame) {
    return wants_workers(frame) && fits(frame, worker) && !frame.unable.contains(worker.id);
  };
  const int most = sequence.record.request.max_workers;
  if (most > 0 && sequence.workers() >= most && !sequence.has_worker(worker.id)) return;
  for (const auto& [turn, frame] : sequence.open) {
    if (suits(*frame)) fitting->push_back({{}, frame});
  }
  int looks = 0;
  for (const auto& [turn, frame] : sequence.waiting) {
    if (++looks > kMostLooks) return;
    if (suits(*frame)) return fitting->push_back({{}, frame});
  }
}

double Scheduler::late_deadline(const Job& job, double now) const {
  if (job.record.deadline <= 0) return kNoDeadline;
  const double due = job.record.deadline - options_.unix_offset;
  const Sequence* const sequence = jobs.sequence_of(job);
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

std::vector<Turn> Scheduler::turns(const Worker& worker, double now) const {
  // Of a submitter's jobs those that will miss their deadline come first, then those that nobody works for
  // yet; of equals the older one. The frames of a sequence stand together, in the order of their turns.
  std::vector<Turn> fitting;
  for (const auto& [rank, job] : jobs.singles()) add_single(*job, worker, &fitting);
  for (const auto& [id, sequence] : jobs.live()) add_frames(*sequence, worker, &fitting);
  for (auto& [key, job] : fitting) {
    const auto [submitters, own] = shares_.standing(job->record, share_of(*job));
    key = {-int64_t{job->record.priority}, submitters, late_deadline(*job, now), jobs.begun(*job), own};
  }
  std::stable_sort(fitting.begin(), fitting.end(),
                   [](const Turn& a, const Turn& b) { return a.key < b.key; });
  return fitting;
}

std::vector<Turn> Scheduler::candidates(const Worker& worker, double now) {
  update_competing();  // who joins begins level with the others
  std::vector<Turn> ordered = turns(worker, now);
  if (worker.run_left > 0 && !ordered.empty()) {
    const int top = ordered.front().job->record.priority;
    const auto same = std::find_if(ordered.begin(), ordered.end(), [&](const Turn& turn) {
      return turn.job->record.id == worker.last_job && turn.job->record.priority == top;
    });
    // It goes on where it is, after those that are late and those that nobody works for yet.
    const auto first_begun = std::find_if(ordered.begin(), ordered.end(), [](const Turn& turn) {
      return turn.key.begun && turn.key.late_deadline == kNoDeadline;
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

template <class MayTake>
std::optional<Scheduler::Found> Scheduler::first_offer(const std::vector<Turn>& turns, const Worker& worker,
                                                       double now, MayTake may_take) const {
  for (const bool in_memory : {true, false}) {
    for (const Turn& turn : turns) {
      const bool is_admitted = admission_.admitted(turn.job->record.id);
      if (in_memory ? !is_admitted && !may_take(*turn.job) : is_admitted) continue;
      Offer offer = offer_of(*turn.job, worker, now);
      if (!std::holds_alternative<std::monostate>(offer)) return Found{turn.job, std::move(offer)};
    }
  }
  return std::nullopt;
}

const Job* Scheduler::next_served(const std::vector<Turn>& turns, const Worker& worker, double now) const {
  const auto found = first_offer(turns, worker, now, [&](const Job& job) { return has_room(job, now); });
  return found ? found->job : nullptr;
}

bool Scheduler::has_room(const Job& job, double now) const {
  return admission_.may_take(job.record.id, claim(job), now);
}

Offer Scheduler::offer(const WorkerId& worker_id, double now) {
  const Worker* worker = workers.find(worker_id);
  if (!worker || !workers.may_work(*worker, now)) return {};
  if (worker->leases >= WorkerTable::most_leases(*worker)) return {};
  const std::vector<Turn> turns = candidates(*worker, now);
  bool claims_are_new = false;
  const auto may_take = [&](const Job& job) {
    if (!claims_are_new) {  // mostly the first job is admitted already, and nobody asks
      for (const Turn& turn : turns) admission_.update(turn.job->record.id, claim(*turn.job));
      claims_are_new = true;
    }
    return has_room(job, now);
  };
  if (std::optional<Found> found = first_offer(turns, *worker, now, may_take)) {
    const JobId& id = found->job->record.id;
    if (!admission_.admitted(id) && may_take(*found->job)) admission_.take(id, claim(*found->job), now);
    return std::move(found->offer);
  }
  for (const Turn& turn : turns) {
    if (const auto tile = tail_.tile_to_race(*turn.job, *worker, now, kIdlePatience))
      return LeaseOffer{turn.job->record.id, *tile};
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
  if (awaits_denoised_error(job)) return false;
  return rounds_.next_round(job, now).empty();
}

}  // namespace lightmill
