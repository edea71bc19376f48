#include "coordinator/service/limits/rate_limiter.h"

#include <algorithm>

namespace lightmill {

void RateLimiter::forget_idle(double now) {
  std::erase_if(buckets_, [&](const auto& entry) {
    return entry.second.left + (now - entry.second.at) * per_second_ >= burst_;
  });
}

double RateLimiter::take(const std::string& name, double now) {
  const std::lock_guard lock(mutex_);
  if (buckets_.size() >= kMaxNames && !buckets_.contains(name)) forget_idle(now);
  const bool shared = buckets_.size() >= kMaxNames && !buckets_.contains(name);
  Bucket& bucket = buckets_.try_emplace(shared ? std::string() : name, Bucket{burst_, now}).first->second;
  bucket.left = std::min(burst_, bucket.left + std::max(0.0, now - bucket.at) * per_second_);
  bucket.at = now;
  if (bucket.left < 1) return (1 - bucket.left) / per_second_;
  bucket.left -= 1;
  return 0;
}

}  // namespace lightmill
