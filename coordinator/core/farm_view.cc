#include "coordinator/core/farm_view.h"

#include <algorithm>
#include <chrono>
#include <deque>
#include <optional>
#include <string>

#include "coordinator/farm/job_progress.h"
#include "coordinator/farm/waiting/waiting_note.h"

namespace lightmill {
namespace {

constexpr size_t kMaxListedJobs = 1000;

/// What the record says, as clients see it.
JobStatus status_of(const JobRecord& r) {
  JobStatus s;
  s.id = r.id;
  s.name = r.name;
  s.state = r.state;
  s.message = r.message;
  s.settings = r.settings;
  s.bundle_digest = r.bundle_digest;
  s.priority = r.priority;
  s.pool = r.pool;
  s.submitter = r.submitter;
  s.max_workers = r.max_workers;
  s.deadline = r.deadline;
  s.after = r.after;
  s.packets_done = r.packets_done;
  s.packets_total = FarmView::packets_total(r);
  s.tiles_committed = r.tiles_committed;
  s.leases_reassigned = r.leases_reassigned;
  s.commit_bytes = r.commit_bytes;
  s.spp = static_cast<double>(r.pixel_samples) / static_cast<double>(r.settings.grid.crop.area());
  s.cpu_seconds = r.cpu_seconds;
  s.counters = r.counters;
  s.dropped = shares_of(r.dropped, r.pixel_samples, r.image_mean);
  s.missing_light = r.missing_light;
  return s;
}

TileMap map_of(const LeaseTable& tiles, double now) {
  TileMap map;
  map.complete_samples = tiles.complete_samples();
  const std::vector<LeaseTable::Round>& rounds = tiles.rounds();
  // Tiles follow round after round: those of the last complete round and after are the end of the table.
  size_t first = 0;
  while (first + 1 < rounds.size() && rounds[first + 1].end <= map.complete_samples) ++first;
  const int64_t begin = rounds.empty() ? 0 : rounds[first].begin;
  const std::deque<TileRecord>& all = tiles.tiles();
  const auto is_earlier = [&](const TileRecord& tile) { return tile.tile.sample_begin < begin; };
  const auto from = std::find_if(all.rbegin(), all.rend(), is_earlier).base();
  for (auto tile = from; tile != all.end(); ++tile) {
    map.tiles.push_back(tile_status(*tile));
    map.tiles.back().digest.clear();
  }
  for (const LeaseTable::Lease& lease : tiles.leases()) {
    double& seconds = map.leased_seconds[lease.tile];
    seconds = std::max(seconds, now - lease.since);
  }
  return map;
}

}  // namespace

int64_t FarmView::packets_total(const JobRecord& job) {
  if (job.state == JobState::kDone) return job.packets_done;
  return job.settings.grid.cells().count() * block_count(job.settings.spp);
}

/// What the record's message does not say: why nothing happens, and what is lost.
void FarmView::add_notes(const Job& job, double now, JobStatus* s) const {
  const auto add = [&](const std::string& note) {
    if (!note.empty()) s->message += (s->message.empty() ? "" : "; ") + note;
  };
  const WaitingNote waits = waiting_note(farm_.scheduler, turns_, job, now);
  add(waits.why);
  if (job.tiles.leased_count() == 0) s->waiting = waits.why;
  s->waits_behind = waits.behind;
  s->turn_seconds = waits.turn_seconds;
  if (waits.end_seconds >= 0) s->eta_seconds = waits.end_seconds;
  if (is_final(s->state)) return;
  add(farm_.scheduler.deadline_note(job, now));
  add(job.missing_file);
  if (s->state == JobState::kPaused) return;
  const std::optional<std::string> fault = job.fault.empty() ? farm_.health.fault() : job.fault;
  if (fault) s->message = *fault + "; the job goes on by itself once that is mended";
  if (!fault && job.lacks_file) add("the job goes on by itself once it is back");
  if (fault || job.lacks_file) s->state = JobState::kPaused;
}

JobStatus FarmView::status(const Job& job, double now) const {
  JobStatus s = status_of(job.record);
  s.eta_seconds = eta_seconds(job, now);
  add_notes(job, now, &s);
  s.tiles_leased = job.tiles.leased_count();
  s.tiles_pending = job.tiles.pending_count();
  s.wall_seconds = wall_seconds(job, now);
  s.samples_per_second = recent_rate(job.recent, now);
  if (job.last_estimate) {
    s.relmse = job.last_estimate->relmse;
    s.relmse_low = job.last_estimate->relmse_low;
    s.relmse_high = job.last_estimate->relmse_high;
    s.boxes = job.last_estimate->boxes;
  }
  if (job.last_denoised) {
    s.denoised_relmse = job.last_denoised->denoised_relmse;
    s.denoised_relmse_low = job.last_denoised->denoised_relmse_low;
    s.denoised_relmse_high = job.last_denoised->denoised_relmse_high;
  }
  s.workers = job.tiles.workers();
  s.version = job.version;
  return s;
}

std::vector<JobStatus> FarmView::jobs(size_t begin, size_t count, bool frames) const {
  const std::lock_guard lock(farm_.mutex);
  const double now = farm_.clock.now();
  const std::vector<JobId>& order = farm_.scheduler.jobs.order();
  std::vector<JobStatus> result;
  begin = std::min(begin, order.size());
  const size_t end = begin + std::min(count, order.size() - begin);
  for (size_t i = begin; i < end; ++i) {
    const Job& job = jobs_.get(order[i]);
    if (frames || !job.record.frame) result.push_back(status(job, now));
  }
  return result;
}

std::vector<JobStatus> FarmView::newest_jobs() const {
  const size_t count = job_count();
  return jobs(count - std::min(count, kMaxListedJobs), kMaxListedJobs);
}

size_t FarmView::job_count() const {
  const std::lock_guard lock(farm_.mutex);
  return farm_.scheduler.jobs.order().size();
}

JobPage FarmView::page(size_t begin, size_t count, uint64_t version, bool waiting, bool frames) const {
  const std::lock_guard lock(farm_.mutex);
  const double now = farm_.clock.now();
  const std::vector<JobId>& order = farm_.scheduler.jobs.order();
  JobPage page;
  page.total = order.size();
  page.version = farm_.version;
  const size_t end = std::min(order.size(), begin + std::min(count, order.size()));
  for (size_t i = begin; i < end; ++i) {
    const Job& job = *farm_.scheduler.jobs.find(order[i]);
    if (!frames && job.record.frame) continue;
    const bool open = waiting && !is_final(job.record.state);
    if (job.version > version || job.tiles.leased_count() > 0 || open) page.jobs.push_back(status(job, now));
  }
  return page;
}

JobStatus FarmView::job(const JobId& id) const {
  const std::lock_guard lock(farm_.mutex);
  return status(jobs_.get(id), farm_.clock.now());
}

JobStatus FarmView::wait(const JobId& id, uint64_t version, double timeout_s) const {
  // Real time, not the injected clock's: a simulated clock must not make anybody sleep.
  const auto end = std::chrono::steady_clock::now() +
                   std::chrono::duration<double>(std::clamp(timeout_s, 0.0, kMaxWaitSeconds));
  std::unique_lock lock(farm_.mutex);
  farm_.changed.wait_until(lock, end, [&] { return farm_.stopping || jobs_.get(id).version > version; });
  return status(jobs_.get(id), farm_.clock.now());
}

std::vector<TileStatus> FarmView::tiles(const JobId& id) const {
  std::vector<TileRecord> records;
  {
    const std::lock_guard lock(farm_.mutex);
    records = jobs_.ledger(jobs_.get(id));
  }
  std::vector<TileStatus> result;
  result.reserve(records.size());
  for (const TileRecord& tile : records) result.push_back(tile_status(tile));
  return result;
}

TileMap FarmView::tile_map(const JobId& id) const {
  {
    const std::lock_guard lock(farm_.mutex);
    const Job& job = jobs_.get(id);
    if (job.ledger_loaded) return map_of(job.tiles, farm_.clock.now());
  }
  // The job has ended. Its ledger may be long, and nobody shall wait for it.
  std::vector<TileRecord> records = farm_.store->tiles(id);
  for (TileRecord& tile : records) {  // its leases are void
    if (tile.state == TileState::kLeased) tile = voided(tile);
  }
  LeaseTable stored;
  stored.add(records);
  return map_of(stored, farm_.clock.now());
}

std::vector<std::pair<WorkerId, LeaseKey>> FarmView::holdings() const {
  const std::lock_guard lock(farm_.mutex);
  std::vector<std::pair<WorkerId, LeaseKey>> held;
  for (const JobId& id : farm_.scheduler.jobs.active()) {
    for (const LeaseTable::Lease& lease : farm_.scheduler.jobs.find(id)->tiles.leases()) {
      held.push_back({lease.worker, {id, lease.tile, lease.attempt}});
    }
  }
  return held;
}

WorkerPage FarmView::workers(const WorkerId& after, size_t most) const {
  const std::lock_guard lock(farm_.mutex);
  return farm_.scheduler.workers.page(after, most, farm_.clock.now());
}

TimelinePage FarmView::timelines(const WorkerId& after, size_t most, int64_t since) const {
  const std::lock_guard lock(farm_.mutex);
  TimelinePage page = farm_.scheduler.workers.timelines(after, most, since, farm_.clock.now());
  page.cell_origin = farm_.scheduler.unix_offset();
  return page;
}

FarmStats FarmView::stats() const {
  const std::lock_guard lock(farm_.mutex);
  FarmStats stats = farm_.stats;
  stats.refusals["commit_stale"] = stats.commits_stale;
  stats.refusals["commit_corrupt"] = stats.commits_corrupt;
  stats.refusals["spot_check"] = stats.liars;
  stats.storage_fault = farm_.health.fault().has_value();
  stats.film_loads = farm_.merger.loads();
  stats.film_bytes = farm_.merger.bytes();
  return stats;
}

}  // namespace lightmill
