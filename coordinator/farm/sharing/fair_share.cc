#include "coordinator/farm/sharing/fair_share.h"

#include <algorithm>
#include <limits>

namespace lightmill {

FairShare::Account& FairShare::account(const JobRecord& job) { return levels_[job.priority][job.submitter]; }

void FairShare::join(const JobRecord& job, JobShare* share) {
  if (share->competes) return;
  share->competes = true;
  Level& level = levels_[job.priority];
  Account& own = level[job.submitter];
  constexpr double kNobody = std::numeric_limits<double>::infinity();
  if (own.competing.empty()) {
    double least = kNobody;
    for (const auto& [name, other] : level) {
      if (!other.competing.empty()) least = std::min(least, other.served);
    }
    if (least < kNobody) own.served = std::max(own.served, least);
  }
  double least = kNobody;
  for (const JobShare* other : own.competing) least = std::min(least, other->served);
  if (least < kNobody) share->served = std::max(share->served, least);
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
