#include "coordinator/farm/sharing/deadlines.h"

#include <algorithm>

#include "coordinator/farm/job_progress.h"

namespace lightmill {
namespace {

constexpr double kLookSeconds = 1;
constexpr double kMargin = 1.1;  // of the time that is left to go: rates change

template <class Eta>
const Punctuality& look(Punctuality& p, double due, double now, Eta eta_of) {
  if (p.looked_at >= 0 && now - p.looked_at < kLookSeconds) return p;
  p.looked_at = now;
  const double eta = eta_of();
  p.late = eta < 0 || now + kMargin * eta > due;
  p.seconds_late = eta < 0 ? 0 : std::max(0.0, now + eta - due);
  return p;
}

}  // namespace

const Punctuality& look_at_deadline(const Job& job, double due, double now) {
  return look(job.punctuality, due, now, [&] { return eta_seconds(job, now); });
}

const Punctuality& look_at_deadline(const Sequence& sequence, double due, double now) {
  return look(sequence.punctuality, due, now, [&] { return eta_seconds(sequence, now); });
}

}  // namespace lightmill
