#include "coordinator/farm/job_tail.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "coordinator/farm/round_planner.h"
#include "coordinator/farm/sharing/film_bytes.h"
#include "coordinator/farm/tiling.h"

namespace lightmill {
namespace {

constexpr double kShortestPartSeconds = 0.1;  // below, leasing and merging cost more than rendering
constexpr int64_t kMostParts = 16;            // of one tile at a time
// What one more part costs, of processors' time: a lease and a commit, and where there are splats a layer as
// large as the window, packed, handed in and merged.
constexpr double kPartCostSeconds = 0.01, kSplatByteCostSeconds = 40e-9;
// A part for a worker that idles takes so many times that at least.
constexpr double kIdlePartOfCost = 10;
// A tile is cut to even out the end if that saves the others so many times as much of waiting, and if what is
// cut off is more than so much of the tile: speeds are not known better.
constexpr double kSavedOfCost = 3, kLeastCutOff = 0.1;
// Of the tiles a second that may come in, so many may be the last ones of all workers in one second.
constexpr double kLastTilesOfRate = 2;
// A holder is late after so many times the expected time, and a moment for what is not rendering.
constexpr double kLateFactor = 1.5, kSlackSeconds = 0.25;
// Whoever will have the tile in less than so much of the time that its holder still needs may race for it.
constexpr double kMuchSooner = 0.5;
constexpr double kLateWithoutEstimate = 3;  // target tile times
constexpr size_t kMostRacers = 64;          // for one tile
// A lease ends after so many times what makes its holder late, and some lease times for a scene that has to
// be fetched; after twice as long each time that this happens to the tile: it may be a heavy one.
constexpr double kLifeFactor = 8, kLeasesOfLife = 3;
constexpr int kMostDoubled = 12;

// With as many workers their counts are a moment old: counting takes about so long for each of them, and the
// pause until the next time is that times kCountPause; kLookPause where tiles to race for are looked for.
constexpr size_t kManyWorkers = 1000;
constexpr double kCountSeconds = 2e-7, kCountPause = 50, kLookPause = 10;

/// One rectangle with about `share` of the cells, and the rest.
std::vector<CellRect> cut_off(const CellRect& cells, double share) {
  const bool wide = cells.width() > cells.height();
  const int length = wide ? cells.width() : cells.height();
  const int at = std::clamp(static_cast<int>(std::lround(share * length)), 1, length - 1);
  CellRect first = cells, rest = cells;
  (wide ? first.x1 : first.y1) = (wide ? rest.x0 : rest.y0) = (wide ? cells.x0 : cells.y0) + at;
  return {first, rest};
}

/// Seconds that the worker is expected to take for the tile; negative: unknown.
double expected_seconds(const Job& job, const TileSpec& tile, const Worker& worker) {
  const JobRecord& record = job.record;
  const auto samples = static_cast<double>(record.settings.grid.pixels(tile.cells).area() * tile.samples());
  if (worker.samples_per_second > 0)
    return samples / worker.samples_per_second * WorkerTable::slowdown(worker);
  if (record.pixel_samples <= 0 || !(record.cpu_seconds > 0)) return -1;
  return samples * record.cpu_seconds / static_cast<double>(record.pixel_samples) /
         worker.registration.threads;
}

}  // namespace

void JobTail::share_rest(const Job& job, const Worker& worker, double now, TailCounts* counts) const {
  counts->seconds_to_end = -1;
  double seconds = 0;
  for (const int64_t id : job.tiles.pending()) {
    const double tile = expected_seconds(job, job.tiles.find(TileId{id})->tile, worker);
    if (tile < 0) return;
    seconds += tile;
  }
  std::unordered_set<const Worker*> others;
  for (const LeaseTable::Lease& lease : job.tiles.leases()) {
    const Worker* holder = workers_.find(lease.worker);
    if (!holder || lease.worker == worker.id) continue;
    const double tile = expected_seconds(job, job.tiles.find(lease.tile)->tile, *holder);
    if (tile < 0) return;
    seconds += std::max(0.0, tile - (now - lease.since));
    others.insert(holder);
  }
  counts->sharers = static_cast<int64_t>(others.size()) + 1;
  counts->seconds_to_end = seconds / static_cast<double>(counts->sharers);
}

TailCounts JobTail::count_tail(const Job& job, const Worker& worker, double now) const {
  const size_t many = workers_.all().size();
  TailCounts& last = job.tail;
  const double pause = static_cast<double>(many) * kCountSeconds * kCountPause;
  if (many >= kManyWorkers && last.counted_at >= 0 && now - last.counted_at < pause) return last;
  last.counted_at = now;
  last.idle = 0;
  for (const auto& [id, other] : workers_.all()) {
    last.idle += other.leases == 0 && workers_.may_work(other, now) && fits(job, other);
  }
  share_rest(job, worker, now, &last);
  return last;
}

std::vector<CellRect> JobTail::parts_for_idle(const Job& job, TileId id, const Worker& worker,
                                              double now) const {
  const int64_t pending = job.tiles.pending_count();
  if (pending >= static_cast<int64_t>(workers_.all().size()) || !job.tiles.may_split(id) ||
      !is_planned_out(job, now)) {
    return {};
  }
  const TileSpec& tile = job.tiles.find(id)->tile;
  const double seconds = expected_seconds(job, tile, worker);
  const double bytes = splat_layer_bytes(job.record.settings), ingest = options_.ingest_bytes_per_second;
  const int threads = worker.registration.threads;
  int64_t most = std::min(kMostParts, tile.cells.count());
  if (seconds >= 0) {
    double shortest =
        std::max(kShortestPartSeconds, kIdlePartOfCost * bytes * kSplatByteCostSeconds / threads);
    // n parts are rendered in seconds / n, and handed in one after the other.
    if (ingest > 0) shortest = std::max(shortest, std::sqrt(seconds * bytes / ingest));
    most = std::min(most, static_cast<int64_t>(std::min(seconds / shortest, 1e9)));
  }
  const TailCounts counts = count_tail(job, worker, now);
  int64_t idle = counts.idle;
  if (job.record.max_workers > 0)
    idle = std::min<int64_t>(idle, job.record.max_workers - job.tiles.workers());
  const int64_t parts = std::min(most, (idle + pending - 1) / pending);
  if (parts >= 2) return split_cells(tile.cells, parts);
  if (seconds < 0 || counts.seconds_to_end < 0) return {};
  // Were it not cut, all others would wait for this tile in the end.
  const auto sharers = static_cast<double>(counts.sharers);
  const double mine = std::max(counts.seconds_to_end, kShortestPartSeconds), rest = seconds - mine;
  double least = std::max(kShortestPartSeconds, kLeastCutOff * seconds);
  if (ingest > 0) least = std::max(least, sharers * bytes / ingest);  // one after the other, as above
  if (options_.commits_per_second > 0)
    least = std::max(least, sharers / (kLastTilesOfRate * options_.commits_per_second));
  const double cost = kPartCostSeconds + bytes * kSplatByteCostSeconds;
  if (rest < least || rest * sharers * threads < kSavedOfCost * cost) return {};
  return cut_off(tile.cells, mine / seconds);
}

double JobTail::late_after(const Job& job, const LeaseTable::Lease& lease) const {
  const TileSpec& tile = job.tiles.find(lease.tile)->tile;
  const Worker* holder = workers_.find(lease.worker);
  const double theirs = holder && !is_pilot(tile) ? expected_seconds(job, tile, *holder) : -1;
  return theirs >= 0 ? kLateFactor * theirs + kSlackSeconds
                     : kLateWithoutEstimate * options_.target_tile_seconds;
}

bool JobTail::may_join(const Job& job, const std::vector<LeaseTable::Lease>& leases, const Worker& worker,
                       double now, double patience) const {
  const TileId id = leases.front().tile;
  if (leases.size() >= kMostRacers || job.failed_on.contains({id, worker.id})) return false;
  bool unproven = true;
  for (const LeaseTable::Lease& lease : leases) {
    if (lease.worker == worker.id) return false;
    const Worker* holder = workers_.find(lease.worker);
    unproven = unproven && (!holder || !WorkerTable::is_proven(*holder));
  }
  const LeaseTable::Lease& newest = leases.back();
  const double age = now - newest.since, late = late_after(job, newest);
  if (leases.size() > 1) {
    const double pause = unproven ? std::min(late, options_.target_tile_seconds)
                                  : std::ldexp(late, static_cast<int>(leases.size()) - 1);
    return age > patience * pause;
  }
  if (age > patience * late) return true;
  const TileSpec& tile = job.tiles.find(id)->tile;
  const Worker* holder = workers_.find(newest.worker);
  if (is_pilot(tile) || !holder) return false;
  const double theirs = expected_seconds(job, tile, *holder), ours = expected_seconds(job, tile, worker);
  return theirs >= 0 && ours >= 0 && patience * (ours + kSlackSeconds) < kMuchSooner * (theirs - age);
}

std::optional<TileId> JobTail::tile_to_race(const Job& job, const Worker& worker, double now,
                                            double patience) const {
  if (job.tiles.leased_count() == 0) return std::nullopt;
  if (!needs_pilot(job.record.settings) && !is_planned_out(job, now)) return std::nullopt;
  const size_t many = workers_.all().size();
  if (many >= kManyWorkers && now < job.tail.look_for_race_at) return std::nullopt;
  std::optional<TileId> slowest;
  double since = 0;
  const std::vector<LeaseTable::Lease> leases = job.tiles.leases();
  job.tail.look_for_race_at = now + static_cast<double>(leases.size()) * kCountSeconds * kLookPause;
  for (size_t i = 0; i < leases.size();) {
    std::vector<LeaseTable::Lease> same;
    for (; i < leases.size() && (same.empty() || same[0].tile == leases[i].tile); ++i)
      same.push_back(leases[i]);
    if (slowest && same.front().since >= since) continue;
    if (!may_join(job, same, worker, now, patience)) continue;
    slowest = same.front().tile;
    since = same.front().since;
  }
  return slowest;
}

std::vector<LeaseTable::Lease> JobTail::overdue(const Job& job, double undisturbed_since, double now) const {
  std::vector<LeaseTable::Lease> over;
  for (const LeaseTable::Lease& lease : job.tiles.leases()) {
    const double age = now - std::max(lease.since, undisturbed_since);
    const double least = kLifeFactor * kSlackSeconds + kLeasesOfLife * options_.lease_seconds;
    if (lease.pins > 0 || age < least) continue;  // mostly
    const auto ended = job.overdue.find(lease.tile);
    const int doubled = ended == job.overdue.end() ? 0 : std::min(ended->second, kMostDoubled);
    const double life = kLifeFactor * late_after(job, lease) + kLeasesOfLife * options_.lease_seconds;
    if (age < std::ldexp(life, doubled)) continue;
    const auto other = [&](const auto& entry) {
      return entry.first != lease.worker && workers_.may_work(entry.second, now) && fits(job, entry.second);
    };
    if (std::any_of(workers_.all().begin(), workers_.all().end(), other)) over.push_back(lease);
  }
  return over;
}

}  // namespace lightmill
