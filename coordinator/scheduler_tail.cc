// The end of a job, when there is less to do than there are workers: tiles are cut, and stragglers raced.
#include <algorithm>
#include <cmath>

#include "coordinator/scheduler.h"

namespace lightmill {
namespace {

constexpr double kShortestPartSeconds = 0.1;  // below, leasing and merging cost more than rendering
constexpr int64_t kMostParts = 16;            // of one tile at a time
// A holder is late after so many times the expected time, and a moment for what is not rendering.
constexpr double kLateFactor = 1.5, kSlackSeconds = 0.25;
// Whoever will have the tile in less than so much of the time that its holder still needs may race for it.
constexpr double kMuchSooner = 0.5;
constexpr double kLateWithoutEstimate = 3;  // target tile times

}  // namespace

double Scheduler::expected_seconds(const Job& job, const TileSpec& tile, const Worker& worker) {
  const JobRecord& record = job.record;
  const auto samples = static_cast<double>(record.settings.grid.pixels(tile.cells).area() * tile.samples());
  if (worker.samples_per_second > 0) return samples / worker.samples_per_second;
  if (record.pixel_samples <= 0 || !(record.cpu_seconds > 0)) return -1;
  return samples * record.cpu_seconds / static_cast<double>(record.pixel_samples) /
         worker.registration.threads;
}

std::vector<CellRect> Scheduler::parts_for_idle(const Job& job, TileId id, const Worker& worker,
                                                double now) const {
  const int64_t pending = job.tiles.pending_count();
  if (pending >= static_cast<int64_t>(workers.all().size()) || !job.tiles.may_split(id) ||
      !is_planned_out(job, now)) {
    return {};
  }
  const TileSpec& tile = job.tiles.find(id)->tile;
  const double seconds = expected_seconds(job, tile, worker);
  int64_t most = std::min(kMostParts, tile.cells.count());
  if (seconds >= 0) {
    most = std::min(most, static_cast<int64_t>(std::min(seconds / kShortestPartSeconds, 1e9)));
  }
  if (most < 2) return {};
  int64_t idle = 0;
  for (const auto& [other_id, other] : workers.all()) {
    idle += other.leases == 0 && workers.may_work(other, now) && fits(job, other);
  }
  if (job.record.max_workers > 0)
    idle = std::min<int64_t>(idle, job.record.max_workers - job.tiles.workers());
  const int64_t parts = std::min(most, (idle + pending - 1) / pending);
  if (parts < 2) return {};
  return split_cells(tile.cells, parts);
}

std::optional<TileId> Scheduler::tile_to_race(const Job& job, const Worker& worker, double now) const {
  if (job.tiles.leased_count() == 0 || !is_planned_out(job, now)) return std::nullopt;
  std::optional<TileId> slowest;
  double since = 0;
  const std::vector<LeaseTable::Lease> leases = job.tiles.leases();
  for (size_t i = 0; i < leases.size(); ++i) {
    const LeaseTable::Lease& lease = leases[i];
    const bool raced = (i > 0 && leases[i - 1].tile == lease.tile) ||
                       (i + 1 < leases.size() && leases[i + 1].tile == lease.tile);
    const TileSpec& tile = job.tiles.find(lease.tile)->tile;
    if (raced || lease.worker == worker.id || is_pilot(tile)) continue;
    if (job.failed_on.contains({lease.tile, worker.id}) || (slowest && lease.since >= since)) continue;
    const Worker* holder = workers.find(lease.worker);
    const double age = now - lease.since;
    const double theirs = holder ? expected_seconds(job, tile, *holder) : -1;
    const double ours = expected_seconds(job, tile, worker);
    const bool late = age > (theirs >= 0 ? kLateFactor * theirs + kSlackSeconds
                                         : kLateWithoutEstimate * options_.target_tile_seconds);
    const bool sooner = theirs >= 0 && ours >= 0 && ours + kSlackSeconds < kMuchSooner * (theirs - age);
    if (!late && !sooner) continue;
    slowest = lease.tile;
    since = lease.since;
  }
  return slowest;
}

}  // namespace lightmill
