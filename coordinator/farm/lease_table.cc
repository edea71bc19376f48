#include "coordinator/farm/lease_table.h"

#include <algorithm>
#include <functional>
#include <stdexcept>

namespace lightmill {
namespace {

constexpr size_t kSpareExpiries = 64;  // of leases that ended, beyond as many as there are leases

/// Puts the leases of a leased tile, the newest last, into the row.
void set_tokens(TileRecord* row, std::vector<LeaseToken> tokens) {
  row->worker = row->rival_worker = {};
  row->rival_attempt = 0;
  if (!tokens.empty() && tokens.back().attempt == row->attempt) {
    row->worker = tokens.back().worker;
    tokens.pop_back();
  }
  if (!tokens.empty()) {
    row->rival_attempt = tokens.back().attempt;
    row->rival_worker = tokens.back().worker;
    tokens.pop_back();
  }
  row->others = std::move(tokens);
}

}  // namespace

void LeaseTable::add(const std::vector<TileRecord>& tiles) {
  for (const TileRecord& tile : tiles) {
    if (tile.id.value != next_id()) throw std::logic_error("tile ids must be dense");
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
      complete_rounds_ = std::min(complete_rounds_, rounds_.size() - 1);
    }
    tiles_.push_back(tile);
    if (tile.state == TileState::kPending) pending_.insert(tile.id.value);
    if (tile.state == TileState::kLeased) leased_.insert(tile.id.value);
    follow(tile, 0, 0);
  }
  count_complete_rounds();
}

const TileRecord* LeaseTable::find(TileId id) const {
  if (id.value < forgotten_ || id.value >= next_id()) return nullptr;
  return &tiles_[index(id)];
}

void LeaseTable::count_complete_rounds() {
  while (complete_rounds_ < rounds_.size() &&
         rounds_[complete_rounds_].committed == rounds_[complete_rounds_].tiles) {
    ++complete_rounds_;
  }
}

void LeaseTable::forget(size_t keep) {
  while (tiles_.size() > keep) {
    const size_t round = round_of_.front();
    const bool over =
        round == kNoRound ? tiles_.front().state == TileState::kCommitted : round + 1 < complete_rounds_;
    if (!over) return;
    tiles_.pop_front();
    round_of_.pop_front();
    ++forgotten_;
  }
}

std::optional<TileId> LeaseTable::next_pending(const std::function<bool(const TileRecord&)>& accept) const {
  for (int64_t id : pending_) {
    if (accept(tiles_[index(TileId{id})])) return TileId{id};
  }
  return std::nullopt;
}

bool LeaseTable::holds(TileId id, const WorkerId& worker, int64_t attempt) const {
  const auto found = leases_.find({id.value, attempt});
  return found != leases_.end() && found->second.worker == worker;
}

std::vector<LeaseTable::Lease> LeaseTable::leases() const {
  std::vector<Lease> all;
  for (const auto& [key, lease] : leases_) all.push_back(lease);
  return all;
}

std::vector<LeaseTable::Lease> LeaseTable::leases_of(TileId id) const {
  std::vector<Lease> all;
  for (auto it = leases_.lower_bound({id.value, 0}); it != leases_.end() && it->first.first == id.value; ++it)
    all.push_back(it->second);
  return all;
}

TileRecord LeaseTable::leased_to(TileId id, const WorkerId& worker) const {
  TileRecord record = *find(id);
  if (record.state == TileState::kCommitted) throw std::logic_error("a committed tile can't be leased");
  std::vector<LeaseToken> tokens =
      record.state == TileState::kLeased ? lease_tokens(record) : std::vector<LeaseToken>();
  record.state = TileState::kLeased;
  tokens.push_back({++record.attempt, worker});
  set_tokens(&record, std::move(tokens));
  return record;
}

TileRecord LeaseTable::released(TileId id, int64_t attempt, bool failed) const {
  TileRecord record = *find(id);
  if (!leases_.contains({id.value, attempt})) throw std::logic_error("only a lease can be released");
  if (failed) ++record.failures;
  std::vector<LeaseToken> tokens = lease_tokens(record);
  const auto ended = std::find_if(tokens.begin(), tokens.end(),
                                  [&](const LeaseToken& token) { return token.attempt == attempt; });
  const WorkerId last = ended->worker;
  tokens.erase(ended);
  if (tokens.empty()) record.state = TileState::kPending;
  set_tokens(&record, std::move(tokens));
  if (record.state == TileState::kPending) record.worker = last;
  return record;
}

TileRecord LeaseTable::with_stored(TileId id, int64_t attempt) const {
  TileRecord record = *find(id);
  for (LeaseToken& other : record.others) {
    if (other.attempt != attempt) continue;
    std::swap(other.attempt, record.rival_attempt);
    std::swap(other.worker, record.rival_worker);
  }
  return record;
}

TileRecord LeaseTable::committed(TileId id, int64_t attempt, const std::string& digest) const {
  TileRecord record = with_stored(id, attempt);
  record.state = TileState::kCommitted;
  record.digest = digest;
  record.others.clear();
  if (attempt == record.rival_attempt) {
    record.worker = {};
  } else {
    record.rival_attempt = 0;
    record.rival_worker = {};
  }
  return record;
}

void LeaseTable::end_lease(std::map<Key, Lease>::iterator lease) {
  if (const auto holder = holders_.find(lease->second.worker); --holder->second == 0) holders_.erase(holder);
  leases_.erase(lease);
}

void LeaseTable::follow(const TileRecord& record, double expires, double since) {
  const std::vector<LeaseToken> good =
      record.state == TileState::kLeased ? lease_tokens(record) : std::vector<LeaseToken>();
  const int64_t id = record.id.value;
  for (auto it = leases_.lower_bound({id, 0}); it != leases_.end() && it->first.first == id;) {
    const auto ended = it++;
    const LeaseToken token{ended->first.second, ended->second.worker};
    if (std::find(good.begin(), good.end(), token) == good.end()) end_lease(ended);
  }
  for (const LeaseToken& token : good) {
    const Lease lease{record.id, token.attempt, token.worker, since, expires, 0};
    if (!leases_.emplace(Key(id, token.attempt), lease).second) continue;
    ++holders_[token.worker];
    expiries_.emplace_back(expires, Key(id, token.attempt));
    std::push_heap(expiries_.begin(), expiries_.end(), std::greater<>());
    if (expiries_.size() > 2 * leases_.size() + kSpareExpiries) rebuild_expiries();
  }
}

void LeaseTable::rebuild_expiries() {
  expiries_.clear();
  for (const auto& [key, lease] : leases_) expiries_.emplace_back(lease.expires, key);
  std::make_heap(expiries_.begin(), expiries_.end(), std::greater<>());
}

void LeaseTable::apply(const TileRecord& record, double expires, double since) {
  if (!find(record.id)) throw std::logic_error("no such tile");
  TileRecord& tile = tiles_[index(record.id)];
  if (const size_t round = round_of_[index(record.id)]; round != kNoRound) {
    if (tile.state == TileState::kCommitted) --rounds_[round].committed;
    if (record.state == TileState::kCommitted) ++rounds_[round].committed;
    if (rounds_[round].committed < rounds_[round].tiles) complete_rounds_ = std::min(complete_rounds_, round);
    count_complete_rounds();
  }
  pending_.erase(record.id.value);
  leased_.erase(record.id.value);
  if (record.state == TileState::kPending) pending_.insert(record.id.value);
  if (record.state == TileState::kLeased) leased_.insert(record.id.value);
  follow(record, expires, since);
  tile = record;
}

bool LeaseTable::may_split(TileId id) const {
  const TileRecord* tile = find(id);
  return tile && tile->state == TileState::kPending && !rounds_.empty() &&
         round_of_[index(id)] == rounds_.size() - 1 && tile->tile.cells.count() > 1;
}

LeaseTable::Split LeaseTable::split(TileId id, const std::vector<CellRect>& parts) const {
  if (!may_split(id) || parts.size() < 2) throw std::logic_error("this tile can't be split");
  Split split{*find(id), {}};
  split.smaller.tile.cells = parts[0];
  for (size_t i = 1; i < parts.size(); ++i) {
    TileRecord other;
    other.id = TileId{next_id() + static_cast<int64_t>(i) - 1};
    other.tile = split.smaller.tile;
    other.tile.cells = parts[i];
    split.others.push_back(other);
  }
  return split;
}

void LeaseTable::apply(const Split& split) {
  apply(split.smaller);
  add(split.others);
}

LeaseTable::Lease* LeaseTable::find_lease(TileId id, int64_t attempt) {
  const auto found = leases_.find({id.value, attempt});
  return found == leases_.end() ? nullptr : &found->second;
}

void LeaseTable::renew(TileId id, int64_t attempt, double expires) {
  Lease* lease = find_lease(id, attempt);
  if (!lease) return;
  const bool earlier = expires < lease->expires;
  lease->expires = expires;
  if (earlier) rebuild_expiries();  // not what clocks do
}

void LeaseTable::pin(TileId id, int64_t attempt) {
  if (Lease* lease = find_lease(id, attempt)) ++lease->pins;
}

void LeaseTable::unpin(TileId id, int64_t attempt) {
  if (Lease* lease = find_lease(id, attempt); lease && lease->pins > 0) --lease->pins;
}

std::vector<LeaseTable::Lease> LeaseTable::expired(double now) {
  std::vector<Lease> over;
  std::vector<std::pair<double, Key>> later;
  while (!expiries_.empty() && expiries_.front().first <= now) {
    const Key key = expiries_.front().second;
    std::pop_heap(expiries_.begin(), expiries_.end(), std::greater<>());
    expiries_.pop_back();
    const auto found = leases_.find(key);
    if (found == leases_.end()) continue;
    const Lease& lease = found->second;
    later.emplace_back(lease.expires, key);
    if (lease.pins == 0 && lease.expires <= now) over.push_back(lease);
  }
  for (const auto& entry : later) {
    expiries_.push_back(entry);
    std::push_heap(expiries_.begin(), expiries_.end(), std::greater<>());
  }
  std::sort(over.begin(), over.end(), [](const Lease& a, const Lease& b) {
    return std::pair(a.tile.value, a.attempt) < std::pair(b.tile.value, b.attempt);
  });
  return over;
}

}  // namespace lightmill
