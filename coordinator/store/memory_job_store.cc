#include "coordinator/store/memory_job_store.h"

#include <algorithm>
#include <stdexcept>

namespace lightmill {

MemoryJobStore::Entry& MemoryJobStore::entry(const JobId& job) {
  const auto found = jobs_.find(job);
  if (found == jobs_.end()) throw std::logic_error("store: no job " + job.value);
  return found->second;
}

TileRecord& MemoryJobStore::row(Entry& entry, const TileId& id) {
  if (id.value < 0 || static_cast<size_t>(id.value) >= entry.tiles.size()) {
    throw std::logic_error("store: no tile " + std::to_string(id.value));
  }
  return entry.tiles[static_cast<size_t>(id.value)];
}

std::vector<JobRecord> MemoryJobStore::jobs() {
  const std::lock_guard lock(mutex_);
  std::vector<JobRecord> records;
  for (const JobId& id : order_) records.push_back(entry(id).record);
  return records;
}

std::vector<SequenceRecord> MemoryJobStore::sequences() {
  const std::lock_guard lock(mutex_);
  return sequences_;
}

std::vector<TileRecord> MemoryJobStore::tiles(const JobId& job) {
  const std::lock_guard lock(mutex_);
  return entry(job).tiles;
}

std::optional<TileRecord> MemoryJobStore::tile(const JobId& job, TileId id) {
  const std::lock_guard lock(mutex_);
  const std::vector<TileRecord>& ledger = entry(job).tiles;
  if (id.value < 0 || static_cast<size_t>(id.value) >= ledger.size()) return std::nullopt;
  return ledger[static_cast<size_t>(id.value)];
}

std::vector<ErrorPoint> MemoryJobStore::curve(const JobId& job) {
  const std::lock_guard lock(mutex_);
  return entry(job).curve;
}

std::optional<std::string> MemoryJobStore::bundle_json(const std::string& digest) {
  const std::lock_guard lock(mutex_);
  const auto found = bundles_.find(digest);
  if (found == bundles_.end()) return std::nullopt;
  return found->second;
}

Image MemoryJobStore::reference(const JobId& job) {
  const std::lock_guard lock(mutex_);
  return entry(job).reference;
}

std::string MemoryJobStore::pilot(const JobId& job) {
  const std::lock_guard lock(mutex_);
  return entry(job).pilot;
}

LayerSnapshot MemoryJobStore::snapshot(const JobId& job) {
  const std::lock_guard lock(mutex_);
  return entry(job).snapshot;
}

void MemoryJobStore::for_each_spooled(const JobId& job,
                                      const std::function<void(const std::string&)>& visit) {
  std::vector<std::string> spool;
  {
    const std::lock_guard lock(mutex_);
    const Entry& e = entry(job);
    for (const auto& [tile, partial] : e.spool) {
      if (!e.folded.contains(tile)) spool.push_back(partial);
    }
  }
  for (const std::string& partial : spool) visit(partial);
}

std::vector<TileId> MemoryJobStore::kept_partials(const JobId& job) {
  const std::lock_guard lock(mutex_);
  std::vector<TileId> ids;
  for (const auto& [tile, partial] : entry(job).spool) ids.push_back(tile);
  return ids;
}

std::string MemoryJobStore::partial(const JobId& job, TileId tile) {
  const std::lock_guard lock(mutex_);
  const Entry& e = entry(job);
  const auto found = e.spool.find(tile);
  return found == e.spool.end() ? std::string() : found->second;
}

int64_t MemoryJobStore::next_number(const std::string& counter) {
  const std::lock_guard lock(mutex_);
  return ++counters_[counter];
}

void MemoryJobStore::add_job(const JobRecord& job, const std::string& bundle_json, const Image& reference) {
  const std::lock_guard lock(mutex_);
  insert(job, bundle_json, reference);
}

void MemoryJobStore::insert(const JobRecord& job, const std::string& bundle_json, const Image& reference) {
  Entry added;
  added.record = job;
  added.reference = reference;
  jobs_.emplace(job.id, std::move(added));
  bundles_[job.bundle_digest] = bundle_json;
  order_.push_back(job.id);
}

void MemoryJobStore::save_job(const JobRecord& job) {
  const std::lock_guard lock(mutex_);
  entry(job.id).record = job;
}

void MemoryJobStore::save_sequence(const SequenceRecord& sequence) {
  const std::lock_guard lock(mutex_);
  const auto same = std::find_if(sequences_.begin(), sequences_.end(),
                                 [&](const SequenceRecord& other) { return other.id == sequence.id; });
  if (same == sequences_.end()) {
    sequences_.push_back(sequence);
  } else {
    *same = sequence;
  }
}

void MemoryJobStore::add_jobs(const std::vector<NewJob>& jobs) {
  const std::lock_guard lock(mutex_);
  for (const NewJob& job : jobs) insert(job.record, job.bundle_json, {});
}

void MemoryJobStore::save_jobs(const std::vector<JobRecord>& jobs) {
  const std::lock_guard lock(mutex_);
  for (const JobRecord& job : jobs) entry(job.id).record = job;
}

void MemoryJobStore::add_tiles(const JobId& job, const std::vector<TileRecord>& tiles) {
  const std::lock_guard lock(mutex_);
  Entry& e = entry(job);
  for (const TileRecord& tile : tiles) {
    if (static_cast<size_t>(tile.id.value) != e.tiles.size())
      throw std::logic_error("store: tile ids must be dense");
    e.tiles.push_back(tile);
  }
}

void MemoryJobStore::split_tile(const JobId& job, const TileRecord& smaller,
                                const std::vector<TileRecord>& others) {
  {
    const std::lock_guard lock(mutex_);
    row(entry(job), smaller.id) = smaller;
  }
  add_tiles(job, others);
}

void MemoryJobStore::save_tile(const JobRecord& job, const TileRecord& tile) {
  const std::lock_guard lock(mutex_);
  Entry& e = entry(job.id);
  row(e, tile.id) = tile;
  e.record = job;
}

bool MemoryJobStore::mark_committed(Entry& entry, const JobRecord& job, const TileRecord& tile) {
  TileRecord& stored = row(entry, tile.id);
  const std::vector<LeaseToken> good = lease_tokens(stored), used = lease_tokens(tile);
  if (stored.state != TileState::kLeased || used.size() != 1) return false;
  if (std::find(good.begin(), good.end(), used[0]) == good.end()) return false;
  stored = tile;
  entry.record = job;
  return true;
}

bool MemoryJobStore::commit_tile(const JobRecord& job, const TileRecord& tile, std::string_view partial) {
  const std::lock_guard lock(mutex_);
  Entry& e = entry(job.id);
  if (!mark_committed(e, job, tile)) return false;
  if (keep_layers_) e.spool.emplace(tile.id, partial);
  return true;
}

bool MemoryJobStore::commit_pilot(const JobRecord& job, const TileRecord& pilot, std::string_view report) {
  const std::lock_guard lock(mutex_);
  Entry& e = entry(job.id);
  if (!mark_committed(e, job, pilot)) return false;
  e.pilot = report;
  return true;
}

void MemoryJobStore::add_point(const JobId& job, const ErrorPoint& point) {
  const std::lock_guard lock(mutex_);
  entry(job).curve.push_back(point);
}

void MemoryJobStore::checkpoint(const JobId& job, const LayerSnapshot& snapshot, bool keep_partials) {
  const std::lock_guard lock(mutex_);
  Entry& e = entry(job);
  e.snapshot = snapshot;
  if (!keep_partials) e.spool.clear();
  e.folded.clear();
  for (const auto& [tile, partial] : e.spool) e.folded.insert(tile);
}

void MemoryJobStore::take_back(const JobRecord& job, const std::vector<TileRecord>& tiles,
                               const LayerSnapshot& rest) {
  const std::lock_guard lock(mutex_);
  Entry& e = entry(job.id);
  for (const TileRecord& tile : tiles) {
    row(e, tile.id) = tile;
    e.spool.erase(tile.id);
  }
  e.snapshot = rest;
  e.folded.clear();
  if (!rest.film.empty()) {
    for (const auto& [tile, partial] : e.spool) e.folded.insert(tile);
  }
  e.curve.clear();
  e.record = job;
}

}  // namespace lightmill
