#include "coordinator/service/background.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

namespace lightmill {
namespace {

constexpr double kRetrySeconds = 10;
constexpr double kLongestSleep = 3600;

}  // namespace

Background::Background(const Clock& clock, std::function<void(const std::string&)> log)
    : clock_(clock), log_(std::move(log)) {}

Background::~Background() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  ending_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void Background::start(std::vector<Task> tasks) {
  std::erase_if(tasks, [](const Task& task) { return !task; });
  if (!tasks.empty()) thread_ = std::thread([this, tasks = std::move(tasks)] { run(tasks); });
}

double Background::once(const Task& task, double now) {
  try {
    return task(now);
  } catch (const std::exception& error) {
    log_(error.what());
    return kRetrySeconds;
  }
}

void Background::run(const std::vector<Task>& tasks) {
  std::vector<double> due(tasks.size(), clock_.now());
  std::unique_lock lock(mutex_);
  while (!ended_) {
    const size_t next = static_cast<size_t>(std::min_element(due.begin(), due.end()) - due.begin());
    const double wait = std::min(due[next] - clock_.now(), kLongestSleep);
    if (wait > 0) {
      ending_.wait_for(lock, std::chrono::duration<double>(wait));
      continue;
    }
    lock.unlock();
    const double now = clock_.now();
    due[next] = now + once(tasks[next], now);
    lock.lock();
  }
}

}  // namespace lightmill
