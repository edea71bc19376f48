// What views of the whole farm ask for: pages of jobs, who holds what, the end of a ledger, noise.
#include <algorithm>

#include "coordinator/core/farm_impl.h"

namespace lightmill {

TileStatus tile_status(const TileRecord& tile) {
  const std::vector<LeaseToken> tokens = lease_tokens(tile);
  const bool counted = tile.state == TileState::kCommitted && !tokens.empty();
  return {tile.id,
          tile.tile,
          tile_state_name(tile.state),
          counted ? tokens[0].attempt : tile.attempt,
          tokens.empty() ? WorkerId{} : tokens.back().worker,
          tile.digest};
}

JobPage Farm::page(size_t begin, size_t count, uint64_t version, bool waiting) const {
  const std::lock_guard lock(impl_->mutex);
  const double now = impl_->clock.now();
  const std::vector<JobId>& order = impl_->scheduler.order();
  JobPage page;
  page.total = order.size();
  page.version = impl_->version;
  const size_t end = std::min(order.size(), begin + std::min(count, order.size()));
  for (size_t i = begin; i < end; ++i) {
    const Job& job = *impl_->scheduler.find(order[i]);
    const bool open = waiting && !is_final(job.record.state);
    if (job.version > version || job.tiles.leased_count() > 0 || open)
      page.jobs.push_back(impl_->status(job, now));
  }
  return page;
}

std::vector<std::pair<WorkerId, LeaseKey>> Farm::holdings() const {
  const std::lock_guard lock(impl_->mutex);
  std::vector<std::pair<WorkerId, LeaseKey>> held;
  for (const JobId& id : impl_->scheduler.active()) {
    for (const LeaseTable::Lease& lease : impl_->scheduler.find(id)->tiles.leases()) {
      held.push_back({lease.worker, {id, lease.tile, lease.attempt}});
    }
  }
  return held;
}

TileMap Farm::tile_map(const JobId& id) const {
  LeaseTable stored;
  TileMap map;
  const auto collect = [&](const LeaseTable& tiles) {
    map.complete_samples = tiles.complete_samples();
    const std::vector<LeaseTable::Round>& rounds = tiles.rounds();
    // Tiles follow round after round: those of the last complete round and after are the end of the table.
    size_t first = 0;
    while (first + 1 < rounds.size() && rounds[first + 1].end <= map.complete_samples) ++first;
    const int64_t begin = rounds.empty() ? 0 : rounds[first].begin;
    const std::deque<TileRecord>& all = tiles.tiles();
    const auto from = std::find_if(all.rbegin(), all.rend(), [&](const TileRecord& tile) {
                        return tile.tile.sample_begin < begin;
                      }).base();
    for (auto tile = from; tile != all.end(); ++tile) {
      map.tiles.push_back(tile_status(*tile));
      map.tiles.back().digest.clear();
    }
    const double now = impl_->clock.now();
    for (const LeaseTable::Lease& lease : tiles.leases()) {
      double& seconds = map.leased_seconds[lease.tile];
      seconds = std::max(seconds, now - lease.since);
    }
  };
  {
    const std::lock_guard lock(impl_->mutex);
    const Job& job = impl_->job(id);
    if (job.ledger_loaded) {
      collect(job.tiles);
      return map;
    }
  }
  // The job has ended. Its ledger may be long, and nobody shall wait for it.
  std::vector<TileRecord> records = impl_->store->tiles(id);
  for (TileRecord& tile : records) {  // its leases are void
    if (tile.state == TileState::kLeased) tile = voided(tile);
  }
  stored.add(records);
  collect(stored);
  return map;
}

Image Farm::error_map(const JobId& id) const {
  RenderSettings settings;
  {
    const std::lock_guard lock(impl_->mutex);
    settings = impl_->job(id).record.settings;
  }
  const Merger::Open layers = impl_->open_layers(id, settings);
  return layers->batches.error_map(layers->batches.error_map_block());
}

void Farm::set_priority(const JobId& id, int priority) {
  const std::lock_guard lock(impl_->mutex);
  Job& job = impl_->job(id);
  if (is_final(job.record.state)) {
    throw Error(ErrorKind::kFailed, "job " + id.value + " is " + job_state_name(job.record.state) +
                                        "; priority matters to jobs that have not ended");
  }
  const double now = impl_->clock.now();
  JobRecord record = impl_->record_at(job, now);
  record.priority = priority;
  impl_->scheduler.withdraw(job);
  impl_->update(job, std::move(record), now);
}

}  // namespace lightmill
