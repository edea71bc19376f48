#pragma once
// A thread for small pieces of work that nobody waits for, each done when it is due.
//
//   Background background(clock, log);
//   background.start({[&](double now) { return scrub.step(now); }});
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/base/clock.h"

namespace lightmill {

class Background {
 public:
  /// Does a piece of work at time `now`; returns seconds until the next one is due.
  using Task = std::function<double(double now)>;

  /// `clock` must outlive this object. `log` receives what a task throws, which is then tried again.
  Background(const Clock& clock, std::function<void(const std::string&)> log);
  /// Waits for the piece of work at hand, and ends.
  ~Background();
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;
  /// Call once. Empty tasks are left out.
  void start(std::vector<Task> tasks);

 private:
  void run(const std::vector<Task>& tasks);
  double once(const Task& task, double now);

  const Clock& clock_;
  const std::function<void(const std::string&)> log_;
  std::mutex mutex_;
  std::condition_variable ending_;
  bool ended_ = false;  // guarded by mutex_
  std::thread thread_;
};

}  // namespace lightmill
