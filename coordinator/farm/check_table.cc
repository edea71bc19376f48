#include "coordinator/farm/check_table.h"

#include <algorithm>

namespace lightmill {

void CheckTable::add(const TileRecord& tile) {
  Check check;
  check.votes.push_back({lease_tokens(tile).at(0).worker, tile.digest});
  check.attempts = tile.attempt;
  checks_[tile.id] = std::move(check);
}

void CheckTable::forget(const WorkerId& worker) {
  for (auto& [tile, check] : checks_) {
    check.votes.erase(std::remove_if(check.votes.begin() + 1, check.votes.end(),
                                     [&](const Vote& vote) { return vote.worker == worker; }),
                      check.votes.end());
    if (check.lease && check.lease->worker == worker) check.lease.reset();
  }
}

std::vector<TileId> CheckTable::tiles() const {
  std::vector<TileId> ids;
  for (const auto& [tile, check] : checks_) ids.push_back(tile);
  return ids;
}

std::optional<TileId> CheckTable::next(const WorkerId& worker) const {
  for (const auto& [tile, check] : checks_) {
    if (check.lease) continue;
    const auto theirs = [&](const Vote& vote) { return vote.worker == worker; };
    if (std::none_of(check.votes.begin(), check.votes.end(), theirs)) return tile;
  }
  return std::nullopt;
}

int64_t CheckTable::lease(TileId tile, const WorkerId& worker, double expires) {
  Check& check = checks_.at(tile);
  check.lease = LeaseTable::Lease{tile, ++check.attempts, worker, 0, expires, 0};
  return check.attempts;
}

bool CheckTable::holds(TileId tile, const WorkerId& worker, int64_t attempt) const {
  const auto found = checks_.find(tile);
  return found != checks_.end() && found->second.lease && found->second.lease->worker == worker &&
         found->second.lease->attempt == attempt;
}

void CheckTable::renew(TileId tile, double expires) { checks_.at(tile).lease->expires = expires; }
void CheckTable::pin(TileId tile) { ++checks_.at(tile).lease->pins; }
void CheckTable::unpin(TileId tile) { --checks_.at(tile).lease->pins; }
void CheckTable::release(TileId tile) { checks_.at(tile).lease.reset(); }

std::vector<LeaseTable::Lease> CheckTable::leases() const {
  std::vector<LeaseTable::Lease> all;
  for (const auto& [tile, check] : checks_) {
    if (check.lease) all.push_back(*check.lease);
  }
  return all;
}

std::vector<LeaseTable::Lease> CheckTable::expired(double now) const {
  std::vector<LeaseTable::Lease> over;
  for (const auto& [tile, check] : checks_) {
    if (check.lease && check.lease->pins == 0 && check.lease->expires <= now) over.push_back(*check.lease);
  }
  return over;
}

CheckTable::Outcome CheckTable::vote(TileId tile, const std::string& digest) {
  Check& check = checks_.at(tile);
  check.votes.push_back({check.lease->worker, digest});
  check.lease.reset();
  const std::vector<Vote>& votes = check.votes;
  Outcome outcome;
  if (votes.size() == 2) {
    outcome.decided = votes[0].digest == votes[1].digest;
    return outcome;
  }
  outcome.decided = true;
  for (size_t i = 0; i < 3; ++i) {
    const Vote &a = votes[(i + 1) % 3], &b = votes[(i + 2) % 3];
    if (a.digest != b.digest) continue;
    if (votes[i].digest == a.digest) return outcome;  // all the same: a vote was forgotten in between
    outcome.liar = votes[i].worker;
    outcome.first_is_right = i != 0;
    return outcome;
  }
  outcome.hopeless = true;
  return outcome;
}

}  // namespace lightmill
