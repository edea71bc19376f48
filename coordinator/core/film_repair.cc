#include "coordinator/core/film_repair.h"

#include <set>
#include <tuple>
#include <utility>

#include "common/base/log.h"
#include "coordinator/farm/job_progress.h"
#include "coordinator/merge/store_check.h"

namespace lightmill {
namespace {

/// A job that is damaged more often pauses for people to look: then it is not the disk alone.
constexpr int kMostRepairs = 3;

std::string said(const std::string& why, const std::string& mended) {
  return "its stored film could not be read (" + why + "); " + mended;
}

/// The tile as it is before its first lease, but for its attempts, which stay used.
TileRecord uncommitted(TileRecord tile) {
  tile = voided(std::move(tile));
  tile.digest.clear();
  tile.check = TileCheck::kNone;
  return tile;
}

}  // namespace

void FilmRepair::repair_damaged() {
  if (farm_.health.fault()) return;
  std::vector<std::tuple<JobId, JobRecord, std::string>> damaged;
  {
    const std::lock_guard lock(farm_.mutex);
    for (Job* job : farm_.scheduler.active_jobs()) {
      if (!job->needs_repair) continue;
      job->needs_repair = false;
      if (++job->repairs > kMostRepairs) continue;
      damaged.emplace_back(job->record.id, job->record, job->fault);
    }
  }
  for (auto& [id, record, why] : damaged) {
    const LogScope scope({id.value, -1, 0, ""});
    try {
      repair(id, std::move(record), why);
    } catch (const Error& error) {  // the disk: a later look tries again
      farm_.log("job " + id.value + ": " + error.what());
    }
  }
}

void FilmRepair::repair(const JobId& id, JobRecord record, const std::string& why) {
  Merger::Open layers = farm_.merger.hold(id, record.settings);  // nobody folds meanwhile
  keep_damaged(id, why);
  Salvage found = salvage(record);
  Merger::reset(layers);
  if (!found.lost.empty()) return render_again(id, std::move(found), why);
  farm_.merger.replace(id, layers, std::move(found.layers));
  const std::lock_guard lock(farm_.mutex);
  Job& job = jobs_.get(id);
  JobRecord mended = JobTable::record_at(job, farm_.clock.now());
  if (!is_final(mended.state)) mended.message = said(why, "it was built again from its partials");
  farm_.log("job " + id.value + ": " + mended.message);
  job.fault.clear();
  jobs_.update(job, std::move(mended), farm_.clock.now());
}

FilmRepair::Salvage FilmRepair::salvage(const JobRecord& record) const {
  Salvage result{std::make_unique<Merger::Layers>(), without_partials(record), {}};
  result.layers->film = Film(record.settings.grid);
  result.layers->batches = BatchFilm(record.settings.grid);
  const std::vector<TileId> ids = farm_.store->kept_partials(record.id);
  const std::set<TileId> kept(ids.begin(), ids.end());
  for (const TileRecord& tile : farm_.store->tiles(record.id)) {
    if (tile.state != TileState::kCommitted || is_pilot(tile.tile)) continue;
    const std::string bytes = kept.contains(tile.id) ? farm_.store->partial(record.id, tile.id) : "";
    try {
      if (bytes.empty()) throw Error(ErrorKind::kFailed, "no partial is kept");
      const Partial partial = decode_partial(bytes);
      if (!(partial.tile == tile.tile) || encoded_digest(bytes) != tile.digest)
        throw Error(ErrorKind::kFailed, "the partial is not the one that was committed");
      result.layers->film.fold(partial);
      result.layers->batches.fold(partial);
      result.totals = with_partial(std::move(result.totals), partial, tile.tile, bytes.size());
    } catch (const Error&) {
      result.lost.push_back(uncommitted(tile));
    }
  }
  return result;
}

void FilmRepair::keep_damaged(const JobId& id, const std::string& why) const {
  try {
    const std::string film = farm_.store->snapshot(id).film;
    if (!film.empty()) farm_.keep_evidence({id, TileId{0}, 0}, {}, "the stored film: " + why, film);
  } catch (const Error&) {
    return;  // there is nothing to keep
  }
}

void FilmRepair::render_again(const JobId& id, Salvage salvage, const std::string& why) {
  const std::lock_guard lock(farm_.mutex);
  Job& job = jobs_.get(id);
  const double now = farm_.clock.now();
  if (settings_to_json(job.record.settings) != settings_to_json(salvage.totals.settings)) {
    job.needs_repair = true;  // it was extended just now: its packets count anew
    return;
  }
  for (const LeaseTable::Lease& lease : job.tiles.leases()) {
    if (is_final(job.record.state)) return;  // a tile that was leased too often has ended the job
    leases_.release(job, lease, false, "", now);
  }
  for (const LeaseTable::Lease& lease : job.checks.leases()) leases_.end_check(job, lease, 0);
  if (is_final(job.record.state)) return;

  const JobRecord& before = job.record;
  JobRecord record = with_totals_of(JobTable::record_at(job, now), salvage.totals);
  // A job with a time limit gets the time back that it spent on what is lost.
  if (before.pixel_samples > 0) {
    record.wall_seconds *=
        static_cast<double>(record.pixel_samples) / static_cast<double>(before.pixel_samples);
  }
  record.message = said(why, std::to_string(salvage.lost.size()) + " of " +
                                 std::to_string(before.tiles_committed) + " tiles are rendered again");
  farm_.store->take_back(record, salvage.lost);

  farm_.log("job " + id.value + ": " + record.message);
  job.record = std::move(record);
  job.checks = CheckTable();
  job.ledger_loaded = false;
  jobs_.load_ledger(job);
  job.running_since = -1;
  job.fault.clear();
  job.last_point.reset();
  job.last_estimate.reset();
  job.recent.clear();
  farm_.scheduler.state_changed(job);
  farm_.touch(job);
}

}  // namespace lightmill
