#pragma once
// What jobs are ordered by for a worker that asks. Pure.
#include <compare>
#include <cstdint>

namespace lightmill {

/// The lesser comes first: by priority, then by submitter, then among a submitter's jobs. Of equals the one
/// that was submitted earlier.
struct TurnKey {
  int64_t negative_priority = 0;
  double submitter_served = 0;  // processor seconds (fair_share.h)
  double late_deadline = 0;     // clock time, of a job that will miss it; of all others infinity
  bool begun = false;           // somebody works for it, or has
  double served = 0;            // processor seconds
  auto operator<=>(const TurnKey&) const = default;
};

}  // namespace lightmill
