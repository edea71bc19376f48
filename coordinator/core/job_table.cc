#include "coordinator/core/job_table.h"

#include <utility>

#include "coordinator/farm/farm_errors.h"
#include "coordinator/farm/job_progress.h"

namespace lightmill {
namespace {

/// Tiles of a job in memory, of which any number may be pending or leased. Of committed ones the newest are
/// there to tell a commit that is repeated; spot checks may want any.
constexpr size_t kTilesInMemory = 50000;

}  // namespace

JobTable::JobTable(FarmState& farm) : farm_(farm) {
  for (SequenceRecord& sequence : farm_.store->sequences()) farm_.scheduler.jobs.add(std::move(sequence));
  for (const JobRecord& record : farm_.store->jobs()) {
    Job loaded;
    loaded.record = record;
    if (record.frame) take_from_sequence(&loaded.record);
    loaded.ledger_loaded = false;
    loaded.version = ++farm_.version;
    loaded.curve_loaded = false;
    Job& added = farm_.scheduler.add(std::move(loaded));
    if (is_final(record.state)) continue;
    load_curve(added);
    load_ledger(added);
  }
}

void JobTable::take_from_sequence(JobRecord* frame) const {
  const Sequence* sequence = farm_.scheduler.jobs.find(frame->frame->sequence);
  if (!sequence)
    throw StoreError("the job store has frame " + frame->id.value + " and not its sequence; it is damaged");
  const SequenceRequest& request = sequence->record.request;
  frame->priority = request.priority;
  frame->pool = request.pool;
  frame->submitter = request.submitter;
  frame->max_workers = request.max_workers;
  frame->deadline = request.deadline;
  frame->after = request.after;
}

Job& JobTable::get(const JobId& id) {
  Job* found = farm_.scheduler.jobs.find(id);
  if (!found) throw UnknownJob(id);
  try {
    load_curve(*found);
  } catch (const StoreError&) {  // its status is shown without, and the next look tries again
  }
  return *found;
}

Sequence& JobTable::get(const SequenceId& id) {
  Sequence* found = farm_.scheduler.jobs.find(id);
  if (!found) throw UnknownSequence(id);
  return *found;
}

bool JobTable::load_curves(const Sequence& sequence, size_t most) {
  size_t loaded = 0;
  for (const auto& [number, frame] : sequence.frames) {
    if (frame.job->curve_loaded) continue;
    if (loaded++ == most) return false;
    load_curve(*frame.job);
  }
  return true;
}

void JobTable::load_curve(Job& job) {
  if (job.curve_loaded) return;
  for (const ErrorPoint& point : newest_points(farm_.store->curve(job.record.id))) {
    job.last_point = point;
    if (point.relmse) job.last_estimate = point;
    if (point.denoised_relmse) job.last_denoised = point, job.denoised_spp = point.spp;
  }
  job.curve_loaded = true;
}

void JobTable::load_ledger(Job& job) {
  if (job.ledger_loaded) return;
  std::vector<TileRecord> tiles = farm_.store->tiles(job.record.id);
  // Leases from before are void; their attempt numbers stay used.
  for (TileRecord& tile : tiles) {
    if (tile.state == TileState::kLeased) tile = voided(tile);
  }
  job.tiles = LeaseTable();
  job.tiles.add(tiles);
  for (const TileRecord& tile : tiles) {
    if (tile.state == TileState::kCommitted && tile.check == TileCheck::kWanted) job.checks.add(tile);
  }
  job.ledger_loaded = true;
  forget_old_tiles(job);
}

std::vector<TileRecord> JobTable::ledger(const Job& job) const {
  if (job.ledger_loaded && job.tiles.forgotten() == 0)
    return {job.tiles.tiles().begin(), job.tiles.tiles().end()};
  std::vector<TileRecord> tiles = farm_.store->tiles(job.record.id);
  for (TileRecord& tile : tiles) {
    if (!job.ledger_loaded && tile.state == TileState::kLeased) tile = voided(tile);
  }
  return tiles;
}

void JobTable::forget_old_tiles(Job& job) const {
  if (farm_.options.spot_check == 0) job.tiles.forget(kTilesInMemory);
}

JobRecord JobTable::record_at(const Job& job, double now) {
  JobRecord record = job.record;
  record.wall_seconds = wall_seconds(job, now);
  return record;
}

void JobTable::update(Job& job, JobRecord record, double now) {
  farm_.store->save_job(record);
  become(job, std::move(record), now);
}

void JobTable::update_all(std::vector<Change> changes, double now) {
  std::vector<JobRecord> records;
  for (const Change& change : changes) records.push_back(change.record);
  farm_.store->save_jobs(records);
  for (Change& change : changes) become(*change.job, std::move(change.record), now);
}

void JobTable::become(Job& job, JobRecord record, double now) {
  job.record = std::move(record);
  if (job.running_since >= 0) job.running_since = job.record.state == JobState::kPaused ? -1 : now;
  farm_.scheduler.state_changed(job);
  farm_.touch(job);
}

void JobTable::count_end(JobRecord* record) {
  if (!farm_.options.tells_ends) return;
  if (!record->frame) {
    ++record->ends.count;
    return;
  }
  Sequence& sequence = get(record->frame->sequence);
  if (sequence.record.ends.untold()) return;
  SequenceRecord changed = sequence.record;
  ++changed.ends.count;
  farm_.store->save_sequence(changed);
  sequence.record = std::move(changed);
}

void JobTable::end(Job& job, JobState state, const std::string& message, double now) {
  JobRecord record = record_at(job, now);
  record.state = state;
  record.message = message;
  count_end(&record);
  farm_.store->save_job(record);
  become_ended(job, std::move(record));
}

void JobTable::end_all(const std::vector<Job*>& jobs, JobState state, const std::string& message,
                       double now) {
  std::vector<JobRecord> records;
  for (const Job* job : jobs) {
    records.push_back(record_at(*job, now));
    records.back().state = state;
    records.back().message = message;
    count_end(&records.back());
  }
  farm_.store->save_jobs(records);
  for (size_t i = 0; i < jobs.size(); ++i) become_ended(*jobs[i], std::move(records[i]));
}

void JobTable::become_ended(Job& job, JobRecord record) {
  forget_leases(job, job.tiles.leases());
  forget_leases(job, job.checks.leases());
  job.checks = CheckTable();
  job.record = std::move(record);
  job.running_since = -1;
  job.tiles = LeaseTable();  // from now on the store has it; tiles that it calls leased are void
  job.ledger_loaded = false;
  job.failed_on.clear();
  job.unable.clear();
  job.memory_faults.clear();
  job.silent_ends.clear();
  job.overdue.clear();
  job.least_memory = 0;
  job.recent.clear();
  farm_.scheduler.state_changed(job);
  farm_.touch(job);
}

void JobTable::forget_leases(const Job& job, const std::vector<LeaseTable::Lease>& leases) {
  const double now = farm_.clock.now();
  for (const LeaseTable::Lease& lease : leases)
    farm_.scheduler.workers.released(lease.worker, job.record.id, false, now);
}

void JobTable::stop_clock(Job& job, double now) {
  job.record.wall_seconds = wall_seconds(job, now);
  job.running_since = -1;
}

}  // namespace lightmill
