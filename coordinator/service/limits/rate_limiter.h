#pragma once
// Token buckets by name: each name may do `burst` things at once and `per_second` in the long run.
#include <cstddef>
#include <map>
#include <mutex>
#include <string>

namespace lightmill {

/// Thread-safe; remembers a bounded number of names.
class RateLimiter {
 public:
  RateLimiter(double per_second, double burst) : per_second_(per_second), burst_(burst) {}
  /// Takes one. `now`: seconds of any clock that does not run backwards. Returns 0 if it may be done now,
  /// else the seconds to wait.
  double take(const std::string& name, double now);

 private:
  /// Beyond this many names seen lately all new ones share a bucket.
  static constexpr size_t kMaxNames = 4096;
  struct Bucket {
    double left, at;
  };
  void forget_idle(double now);
  const double per_second_, burst_;
  std::mutex mutex_;
  std::map<std::string, Bucket> buckets_;  // guarded by mutex_
};

}  // namespace lightmill
