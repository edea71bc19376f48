#pragma once
// Tells hooks of ends, each of them in a thread of its own, until it has taken the message. One that fails is
// tried again after 5 seconds, 10, 20, ... up to an hour, for a day.
//
//   HookRunner runner(std::move(hooks), {ended, message, told}, clock, log);
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/base/clock.h"
#include "coordinator/core/farm_report.h"
#include "coordinator/hooks/hook.h"

namespace lightmill {

/// Where news come from. All are called by the runner's threads, one at a time.
struct HookNews {
  /// Ends that are to be told, at most so many, as Farm::untold_ends.
  std::function<std::vector<EndNote>(size_t most)> untold;
  /// Empty if it goes on again.
  std::function<std::optional<HookMessage>(const EndNote&)> message;
  /// All hooks were told, or given up.
  std::function<void(const EndNote&)> told;
};

class HookRunner {
 public:
  static constexpr double kFirstWait = 5, kLongestWait = 3600, kPatience = 24 * 3600;  // seconds
  /// Ends that are told at the same time; others wait for these.
  static constexpr size_t kMostAtOnce = 1000;

  /// `clock` must outlive this object. `log` may be empty.
  HookRunner(std::vector<std::unique_ptr<Hook>> hooks, HookNews news, const Clock& clock,
             std::function<void(const std::string&)> log);
  /// Stops the hooks. What they were not told is told after the next start.
  ~HookRunner();
  HookRunner(const HookRunner&) = delete;
  HookRunner& operator=(const HookRunner&) = delete;

 private:
  /// How far one hook is with one message.
  struct Try {
    bool over = false;
    int failures = 0;
    double first = 0, due = 0;  // clock times
  };
  struct Delivery {
    EndNote note;
    HookMessage message;
    std::vector<Try> tries;  // one a hook
  };

  void run(size_t hook);
  /// What is due for the hook; null: nothing is. mutex_ held.
  Delivery* next(size_t hook, double now);
  /// Looks for ends that are not known yet, now and then. mutex_ held.
  void look(double now);
  void failed(size_t hook, Delivery* delivery, const std::string& why, double now);
  /// Forgets what all hooks were told. mutex_ held.
  void settle(const std::string& id);
  void log(const std::string& line) const;

  const std::vector<std::unique_ptr<Hook>> hooks_;
  const HookNews news_;
  const Clock& clock_;
  const std::function<void(const std::string&)> log_;
  std::mutex mutex_;
  std::condition_variable ending_;
  // Guarded by mutex_.
  bool ended_ = false;
  double look_at_ = 0;
  std::map<std::string, Delivery> deliveries_;  // by the message's id
  std::vector<std::thread> threads_;
};

}  // namespace lightmill
