#pragma once
// A loop over several threads whose outcome is that of the plain loop.
//
//   parallel_for(images.size(), threads, [&](size_t i) { maps[i].emplace(images[i]); });
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <limits>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace lightmill {

/// `threads` if positive, else one per processor that this process may use.
inline int thread_count(int threads) {
  return threads > 0 ? threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

/// Starts a thread; false if the system has no more for us, which those that there are make up for.
template <class Run>
bool add_thread(std::vector<std::jthread>* pool, Run&& run) {
  try {
    pool->emplace_back(std::forward<Run>(run));
    return true;
  } catch (const std::system_error&) {
    return false;
  }
}

/// Calls work(i) for i from 0 to count - 1 on up to `threads` threads (0: one per processor), of which this
/// is one, and returns when all are done. What a plain loop would have thrown is thrown: the exception of the
/// lowest i; then some calls of higher i may have been left out.
template <class Work>
void parallel_for(size_t count, int threads, const Work& work) {
  std::atomic<size_t> next{0};
  std::atomic<bool> stop{false};
  std::mutex mutex;
  size_t failed = std::numeric_limits<size_t>::max();
  std::exception_ptr failure;
  // Indices are handed out in order: below one that failed, none is missing.
  const auto run = [&] {
    for (size_t i; !stop.load() && (i = next.fetch_add(1)) < count;) {
      try {
        work(i);
      } catch (...) {
        const std::lock_guard lock(mutex);
        stop = true;
        if (i < failed) {
          failed = i;
          failure = std::current_exception();
        }
      }
    }
  };
  {
    std::vector<std::jthread> pool;
    const size_t helpers = std::min(count, static_cast<size_t>(thread_count(threads)));
    while (pool.size() + 1 < helpers && add_thread(&pool, run)) {
    }
    run();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace lightmill
