#include "coordinator/farm/sharing/fair_share.h"

#include <algorithm>
#include <limits>
#include <tuple>

namespace lightmill {

FairShare::Account& FairShare::account(const JobRecord& job) { return levels_[job.priority][job.submitter]; }

std::pair<double, double> FairShare::standing(const JobRecord& job, const JobShare& share) const {
  if (share.competes) return {*share.submitters, share.served};
  const auto level = levels_.find(job.priority);
  if (level == levels_.end()) return {0, share.served};
  const auto own = level->second.find(job.submitter);
  const bool known = own != level->second.end();
  double submitters = known ? own->second.served : 0, served = share.served;
  constexpr double kNobody = std::numeric_limits<double>::infinity();
  double least = kNobody;
  if (known && !own->second.competing.empty()) {
    for (const JobShare* other : own->second.competing) least = std::min(least, other->served);
    served = std::max(served, least);
    return {submitters, served};
  }
  for (const auto& [name, other] : level->second) {
    if (!other.competing.empty()) least = std::min(least, other.served);
  }
  if (least < kNobody) submitters = std::max(submitters, least);
  return {submitters, served};
}

void FairShare::join(const JobRecord& job, JobShare* share) {
  if (share->competes) return;
  Account& own = account(job);
  std::tie(own.served, share->served) = standing(job, *share);
  share->competes = true;
  own.competing.insert(share);
  share->submitters = &own.served;  // an account with such a job stays
}

void FairShare::leave(const JobRecord& job, JobShare* share) {
  if (!share->competes) return;
  share->competes = false;
  share->submitters = nullptr;
  account(job).competing.erase(share);
  forget_idle(&levels_[job.priority]);
}

void FairShare::forget_idle(Level* level) {
  if (level->size() <= kMaxIdle) return;
  std::erase_if(*level, [](const auto& item) { return item.second.competing.empty(); });
}

double FairShare::submitter_served(const JobRecord& job) const {
  const auto level = levels_.find(job.priority);
  if (level == levels_.end()) return 0;
  const auto found = level->second.find(job.submitter);
  return found == level->second.end() ? 0 : found->second.served;
}

void FairShare::charge(const JobRecord& job, JobShare* share, TileId tile, int64_t attempt, double seconds) {
  if (!share->charges.emplace(LeaseKey{job.id, tile, attempt}, seconds).second) return;
  share->served += seconds;
  account(job).served += seconds;
}

void FairShare::settle(const JobRecord& job, JobShare* share, TileId tile, int64_t attempt, double seconds) {
  const auto found = share->charges.find({job.id, tile, attempt});
  if (found == share->charges.end()) return;
  share->served += seconds - found->second;
  account(job).served += seconds - found->second;
  share->charges.erase(found);
}

void FairShare::settle_all(const JobRecord& job, JobShare* share) {
  for (;;) {
    const auto first = share->charges.lower_bound({job.id, TileId{}, 0});
    if (first == share->charges.end() || first->first.job != job.id) return;
    const LeaseKey key = first->first;
    settle(job, share, key.tile, key.attempt, 0);
  }
}

}  // namespace lightmill
