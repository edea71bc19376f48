#include "coordinator/farm/scheduler.h"

#include <algorithm>
#include <tuple>

#include "coordinator/farm/job_progress.h"
#include "coordinator/farm/sharing/film_bytes.h"

namespace lightmill {
namespace {

constexpr int kRunTiles = 8;  // that a worker gets of a job before another one's turn
// Whoever idles races those who are late. In a farm that never idles they are raced once they are as many
// times as late.
constexpr double kIdlePatience = 1, kBusyPatience = 4;
// So many workers that have delivered something are believed; of others so many in the end.
constexpr size_t kProvenReports = 2, kManyReports = 64;

/// Somebody works for it, or has worked.
bool begun(const Job& job) { return job.record.state != JobState::kQueued || job.tiles.leased_count() > 0; }

/// A tile may be leased: in time, or one of the first round, without which the picture has holes.
bool in_time(const TileRecord& tile, bool is_up) { return !is_up || tile.tile.sample_begin == 0; }

}  // namespace

Job& Scheduler::add(Job job) {
  const JobId id = job.record.id;
  order_.push_back(id);
  rank_[id] = order_.size();
  Job& added = jobs_.insert_or_assign(id, std::move(job)).first->second;
  state_changed(added);
  return added;
}

void Scheduler::state_changed(const Job& job) {
  const size_t rank = rank_.at(job.record.id);
  if (is_final(job.record.state)) {
    withdraw(jobs_.at(job.record.id));
    active_.erase(rank);
  } else {
    active_[rank] = &jobs_.at(job.record.id);
  }
}

void Scheduler::withdraw(Job& job) {
  shares_.settle_all(job.record, &job.share);
  compete(job, false);
}

std::vector<JobId> Scheduler::active() const {
  std::vector<JobId> ids;
  for (const auto& [rank, job] : active_) ids.push_back(job->record.id);
  return ids;
}

std::vector<Job*> Scheduler::active_jobs() const {
  std::vector<Job*> jobs;
  for (const auto& [rank, job] : active_) jobs.push_back(job);
  return jobs;
}

Job* Scheduler::find(const JobId& id) {
  const auto found = jobs_.find(id);
  return found == jobs_.end() ? nullptr : &found->second;
}
const Job* Scheduler::find(const JobId& id) const { return const_cast<Scheduler*>(this)->find(id); }

const Job* Scheduler::waits_for(const Job& job) const {
  if (job.record.state != JobState::kQueued) return nullptr;  // what has begun goes on
  for (const JobId& id : job.record.after) {
    const Job* earlier = find(id);
    if (earlier && earlier->record.state != JobState::kDone) return earlier;
  }
  return nullptr;
}

bool Scheduler::wants_workers(const Job& job) const { return is_runnable(job) && !waits_for(job); }

void Scheduler::compete(Job& job, bool wants) {
  if (wants) {
    shares_.join(job.record, &job.share);
  } else {
    shares_.leave(job.record, &job.share);
    admission_.leave(job.record.id);
  }
}

FilmAdmission::Claim Scheduler::claim(const Job& job) const {
  return {job.record.priority, shares_.submitter_served(job.record), job.share.served,
          film_bytes(job.record.settings)};
}

std::vector<Job*> Scheduler::candidates(const Worker& worker) {
  // Of a submitter's jobs those that nobody works for yet come first; of equals the older one, as in active_.
  struct Candidate {
    std::tuple<int64_t, double, bool, double> key;
    Job* job;
  };
  std::vector<Candidate> fitting;
  for (const auto& [rank, job] : active_) {
    const bool wants = wants_workers(*job);
    if (wants != job->share.competes) compete(*job, wants);
    if (!wants || !fits(*job, worker) || job->unable.contains(worker.id)) continue;
    const int most = job->record.max_workers;
    if (most > 0 && job->tiles.workers() >= most && !job->tiles.has_worker(worker.id)) continue;
    fitting.push_back({{}, job});
  }
  for (auto& [key, job] : fitting) {  // once all compete that do: who joins begins level with the others
    key = {-int64_t{job->record.priority}, *job->share.submitters, begun(*job), job->share.served};
  }
  std::stable_sort(fitting.begin(), fitting.end(),
                   [](const Candidate& a, const Candidate& b) { return a.key < b.key; });
  std::vector<Job*> jobs;
  for (const Candidate& candidate : fitting) jobs.push_back(candidate.job);
  if (worker.run_left > 0 && !jobs.empty()) {
    const int top = jobs.front()->record.priority;
    const auto same = std::find_if(jobs.begin(), jobs.end(), [&](const Job* job) {
      return job->record.id == worker.last_job && job->record.priority == top;
    });
    // It goes on where it is, after those that nobody works for yet.
    const auto first_begun =
        std::find_if(jobs.begin(), jobs.end(), [](const Job* job) { return begun(*job); });
    if (same != jobs.end() && first_begun < same) std::rotate(first_begun, same, same + 1);
  }
  return jobs;
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
  const std::vector<Job*> jobs = candidates(*worker);
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
  shares_.charge(record, &job.share, tile.id, tile.attempt, seconds);
}

void Scheduler::settled(Job& job, TileId tile, int64_t attempt, double seconds) {
  shares_.settle(job.record, &job.share, tile, attempt, seconds);
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
