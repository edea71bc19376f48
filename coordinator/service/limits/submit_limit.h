#pragma once
// Bounds how often a token may submit jobs.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <string>
#include <string_view>

#include "coordinator/service/limits/rate_limiter.h"

namespace lightmill {

/// Whether a call of this RPC ("/package.Service/SubmitJob") is a submission: those whose names begin so are.
inline bool is_submission(std::string_view rpc) {
  return rpc.substr(rpc.rfind('/') + 1).starts_with("Submit");
}

/// Thread-safe.
class SubmitLimit {
 public:
  explicit SubmitLimit(double per_minute)
      : per_minute_(per_minute), limiter_(per_minute / 60, std::max(1.0, per_minute / 6)) {}

  /// Counts one submission by this token. Returns the reason if it comes too soon, else nothing.
  std::string refusal(const std::string& token) {
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    const double wait = limiter_.take(token, std::chrono::duration<double>(now).count());
    if (wait == 0) return "";
    ++refused_;
    return "more than " + std::to_string(std::lround(per_minute_)) +
           " jobs a minute (the coordinator's --submit-rate); try again in " +
           std::to_string(std::lround(std::ceil(wait))) + " s";
  }
  /// Number of submissions that were refused.
  uint64_t refused() const { return refused_; }

 private:
  const double per_minute_;
  std::atomic<uint64_t> refused_{0};
  RateLimiter limiter_;
};

}  // namespace lightmill
