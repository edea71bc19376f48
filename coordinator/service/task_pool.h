#pragma once
// Threads for tasks that may block: started as they are needed, kept for the next task.
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace lightmill {

class TaskPool {
 public:
  /// At most `max_threads` tasks run at once; others wait their turn.
  explicit TaskPool(size_t max_threads) : max_threads_(max_threads) {}
  /// Runs the tasks that it has, then ends its threads.
  ~TaskPool();
  TaskPool(const TaskPool&) = delete;
  TaskPool& operator=(const TaskPool&) = delete;
  /// `task` must not throw. If no thread can be started and none is there, it runs in this call.
  void run(std::function<void()> task);

 private:
  void work();

  const size_t max_threads_;
  std::mutex mutex_;
  std::condition_variable wake_;
  // Guarded by mutex_.
  std::deque<std::function<void()>> tasks_;
  std::vector<std::thread> threads_;
  size_t idle_ = 0;
  bool ending_ = false;
};

}  // namespace lightmill
