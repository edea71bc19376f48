#include "coordinator/core/repair/film_repair.h"

#include <algorithm>
#include <optional>
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

bool is_committed(const TileRecord& tile) {
  return tile.state == TileState::kCommitted && !is_pilot(tile.tile);
}

/// Folds a stored partial if it is the one that was committed; empty if not.
std::optional<Partial> fold(const std::string& bytes, const TileRecord& tile, Merger::Layers& layers) {
  if (bytes.empty()) return std::nullopt;
  try {
    Partial partial = decode_partial(bytes);
    if (!(partial.tile == tile.tile) || encoded_digest(bytes) != tile.digest) return std::nullopt;
    layers.film.fold(partial);
    layers.batches.fold(partial);
    return partial;
  } catch (const Error&) {
    return std::nullopt;
  }
}

}  // namespace

void FilmRepair::repair_damaged() {
  if (farm_.health.fault()) return;
  std::vector<std::tuple<JobId, JobRecord, std::string>> damaged;
  {
    const std::lock_guard lock(farm_.mutex);
    for (Job* job : farm_.scheduler.jobs.active_jobs()) {
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
  const std::string text = said(why, "it was built again from what is left");
  farm_.log("job " + id.value + ": " + text);
  if (!is_final(mended.state)) mended.message = text;
  job.fault.clear();
  jobs_.update(job, std::move(mended), farm_.clock.now());
}

FilmRepair::Salvage FilmRepair::salvage(const JobRecord& record) const {
  const std::vector<TileId> ids = farm_.store->kept_partials(record.id);
  const std::set<TileId> kept(ids.begin(), ids.end());
  const std::vector<TileRecord> ledger = farm_.store->tiles(record.id);
  Salvage found = from_partials(record, ledger, kept);
  // Where partials are kept from the beginning they say it all. Else the snapshot has the other tiles.
  const bool all_kept = std::all_of(ledger.begin(), ledger.end(), [&](const TileRecord& tile) {
    return !is_committed(tile) || kept.contains(tile.id);
  });
  if (all_kept) return found;
  found.layers.reset();  // one film at a time in memory
  try {
    return from_snapshot(record, ledger, kept);
  } catch (const StoreError&) {
    throw;
  } catch (const Error&) {
    return found;
  }
}

FilmRepair::Salvage FilmRepair::from_partials(const JobRecord& record, const std::vector<TileRecord>& ledger,
                                              const std::set<TileId>& kept) const {
  Salvage result{std::make_unique<Merger::Layers>(), without_partials(record), {}};
  result.layers->film = Film(record.settings.grid);
  result.layers->batches = BatchFilm(record.settings.grid);
  for (const TileRecord& tile : ledger) {
    if (!is_committed(tile)) continue;
    const std::string bytes = kept.contains(tile.id) ? farm_.store->partial(record.id, tile.id) : "";
    if (const std::optional<Partial> partial = fold(bytes, tile, *result.layers)) {
      result.totals = with_partial(std::move(result.totals), *partial, tile.tile, bytes.size());
    } else {
      result.lost.push_back(uncommitted(tile));
    }
  }
  return result;
}

FilmRepair::Salvage FilmRepair::from_snapshot(const JobRecord& record, std::vector<TileRecord> ledger,
                                              const std::set<TileId>& kept) const {
  Salvage result{std::make_unique<Merger::Layers>(), record, {}, true};
  const LayerSnapshot snapshot = farm_.store->snapshot(record.id);
  result.layers->film = Film::restore(snapshot.film);
  result.layers->batches = BatchFilm::restore(snapshot.batches);
  JobRecord& totals = result.totals;
  for (TileRecord& tile : ledger) {
    if (!is_committed(tile) || !kept.contains(tile.id)) continue;
    if (fold(farm_.store->partial(record.id, tile.id), tile, *result.layers)) continue;
    // What its partial counted can't be read: the sums of times, bytes and drops stay a little too high.
    totals.packets_done -= packets_completed(tile.tile, record.settings.spp);
    --totals.tiles_committed;
    totals.pixel_samples -= record.settings.grid.pixels(tile.tile.cells).area() * tile.tile.samples();
    tile = uncommitted(std::move(tile));
    result.lost.push_back(tile);
  }
  totals.counters = result.layers->film.counters();
  totals.target_met = false;
  check_film(record.id, record.settings, ledger, result.layers->film);
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
  LayerSnapshot rest;
  if (salvage.has_snapshot) rest = {salvage.layers->film.snapshot(), salvage.layers->batches.snapshot()};
  farm_.store->take_back(record, salvage.lost, rest);

  farm_.log("job " + id.value + ": " + record.message);
  job.record = std::move(record);
  job.checks = CheckTable();
  job.ledger_loaded = false;
  jobs_.load_ledger(job);
  job.running_since = -1;
  job.fault.clear();
  job.last_point.reset();
  job.last_estimate.reset();
  job.last_denoised.reset();
  job.denoised_spp = 0;
  job.recent.clear();
  farm_.scheduler.state_changed(job);
  farm_.touch(job);
}

}  // namespace lightmill
