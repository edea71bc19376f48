#include "coordinator/farm/sharing/film_admission.h"

#include <algorithm>
#include <tuple>

namespace lightmill {

std::optional<std::vector<JobId>> FilmAdmission::yielding(const Claim& claim, double now) const {
  std::vector<JobId> ids;
  double left = bytes_;
  const auto enough = [&] { return ids.size() == admission_.size() || left + claim.bytes <= max_bytes_; };
  if (enough()) return ids;
  std::vector<std::pair<Claim, JobId>> may;
  for (const auto& [id, admitted] : admission_) {
    const bool had_more = std::pair(admitted.claim.submitter_served, admitted.claim.served) >
                          std::pair(claim.submitter_served, claim.served);
    if (admitted.claim.priority < claim.priority ||
        (admitted.claim.priority == claim.priority && had_more && now - admitted.since >= kTurnSeconds)) {
      may.emplace_back(admitted.claim, id);
    }
  }
  std::sort(may.begin(), may.end(), [](const auto& a, const auto& b) {
    const auto key = [](const auto& item) {
      const Claim& c = item.first;
      return std::tuple(c.priority, -c.submitter_served, -c.served, item.second);
    };
    return key(a) < key(b);
  });
  for (const auto& [other, id] : may) {
    ids.push_back(id);
    left -= other.bytes;
    if (enough()) return ids;
  }
  return std::nullopt;
}

bool FilmAdmission::may_take(const JobId& job, const Claim& claim, double now) const {
  return admitted(job) || yielding(claim, now);
}

void FilmAdmission::take(const JobId& job, const Claim& claim, double now) {
  if (admitted(job)) return;
  if (const auto gone = yielding(claim, now)) {
    for (const JobId& id : *gone) leave(id);
  }
  admission_[job] = {claim, now};
  bytes_ += claim.bytes;
}

void FilmAdmission::update(const JobId& job, const Claim& claim) {
  const auto found = admission_.find(job);
  if (found == admission_.end()) return;
  bytes_ += claim.bytes - found->second.claim.bytes;
  found->second.claim = claim;
}

void FilmAdmission::leave(const JobId& job) {
  const auto found = admission_.find(job);
  if (found == admission_.end()) return;
  bytes_ -= found->second.claim.bytes;
  admission_.erase(found);
}

}  // namespace lightmill
