#include "coordinator/lease_table.h"

#include <stdexcept>

namespace lightmill {
void LeaseTable::add(const std::vector<TileRecord>& tiles) {
  for (const TileRecord& tile : tiles) {
    if (tile.id.value != static_cast<int64_t>(tiles_.size()))
      throw std::logic_error("tile ids must be dense");
    if (is_pilot(tile.tile)) {
      round_of_.push_back(kNoRound);
    } else {
      if (rounds_.empty() || rounds_.back().begin != tile.tile.sample_begin) {
        rounds_.push_back({tile.tile.sample_begin, tile.tile.sample_end, 0, 0});
      }
      Round& round = rounds_.back();
      ++round.tiles;
      if (tile.state == TileState::kCommitted) ++round.committed;
      round_of_.push_back(rounds_.size() - 1);
    }
    tiles_.push_back(tile);
    if (tile.state == TileState::kPending) pending_.insert(tile.id.value);
    if (tile.state == TileState::kLeased) {
      leased_[tile.id.value] = {};
      ++holders_[tile.worker];
    }
  }
}

const TileRecord* LeaseTable::find(TileId id) const {
  if (id.value < 0 || id.value >= static_cast<int64_t>(tiles_.size())) return nullptr;
  return &tiles_[static_cast<size_t>(id.value)];
}

int64_t LeaseTable::complete_samples() const {
  int64_t complete = 0;
  for (const Round& round : rounds_) {
    if (round.committed < round.tiles) break;
    complete = round.end;
  }
  return complete;
}

std::optional<TileId> LeaseTable::next_pending(const std::function<bool(const TileRecord&)>& accept) const {
  for (int64_t id : pending_) {
    if (accept(tiles_[static_cast<size_t>(id)])) return TileId{id};
  }
  return std::nullopt;
}

bool LeaseTable::holds(TileId id, const WorkerId& worker, int64_t attempt) const {
  const TileRecord* tile = find(id);
  return tile && tile->state == TileState::kLeased && tile->worker == worker && tile->attempt == attempt;
}

std::vector<TileId> LeaseTable::leased() const {
  std::vector<TileId> ids;
  for (const auto& [id, lease] : leased_) ids.push_back(TileId{id});
  return ids;
}

TileRecord LeaseTable::leased_to(TileId id, const WorkerId& worker) const {
  TileRecord record = *find(id);
  if (record.state != TileState::kPending) throw std::logic_error("only a pending tile can be leased");
  record.state = TileState::kLeased;
  ++record.attempt;
  record.worker = worker;
  return record;
}

TileRecord LeaseTable::released(TileId id, bool failed) const {
  TileRecord record = *find(id);
  if (record.state != TileState::kLeased) throw std::logic_error("only a leased tile can be released");
  record.state = TileState::kPending;
  if (failed) ++record.failures;
  return record;
}

void LeaseTable::apply(const TileRecord& record, double expires) {
  if (!find(record.id)) throw std::logic_error("no such tile");
  TileRecord& tile = tiles_[static_cast<size_t>(record.id.value)];
  if (const size_t round = round_of_[static_cast<size_t>(record.id.value)]; round != kNoRound) {
    if (tile.state == TileState::kCommitted) --rounds_[round].committed;
    if (record.state == TileState::kCommitted) ++rounds_[round].committed;
  }
  pending_.erase(record.id.value);
  if (leased_.erase(record.id.value) > 0) {
    if (const auto holder = holders_.find(tile.worker); --holder->second == 0) holders_.erase(holder);
  }
  if (record.state == TileState::kPending) pending_.insert(record.id.value);
  if (record.state == TileState::kLeased) {
    leased_[record.id.value] = {expires, 0};
    ++holders_[record.worker];
  }
  tile = record;
}

void LeaseTable::renew(TileId id, double expires) {
  const auto found = leased_.find(id.value);
  if (found != leased_.end()) found->second.expires = expires;
}

void LeaseTable::pin(TileId id) {
  const auto found = leased_.find(id.value);
  if (found != leased_.end()) ++found->second.pins;
}

void LeaseTable::unpin(TileId id) {
  const auto found = leased_.find(id.value);
  if (found != leased_.end() && found->second.pins > 0) --found->second.pins;
}

std::vector<TileId> LeaseTable::expired(double now) const {
  std::vector<TileId> ids;
  for (const auto& [id, lease] : leased_) {
    if (lease.pins == 0 && lease.expires <= now) ids.push_back(TileId{id});
  }
  return ids;
}

}  // namespace lightmill
