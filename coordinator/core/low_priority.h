#pragma once
// Work that must not take processors from merging.
#include <sys/resource.h>
#include <unistd.h>

#include <ctime>
#include <exception>
#include <thread>

namespace lightmill {

/// Runs `work` on a thread of low priority and waits for it. The caller keeps its own priority, as one that
/// was lowered can't be raised again. Returns the processor time that it took, in seconds; what it throws is
/// thrown.
template <class Work>
double at_low_priority(const Work& work) {
  constexpr int kNice = 10;
  std::exception_ptr failure;
  double cpu = 0;
  std::thread([&] {
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);  // of this thread alone
    try {
      work();
    } catch (...) {
      failure = std::current_exception();
    }
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    cpu = static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  }).join();
  if (failure) std::rethrow_exception(failure);
  return cpu;
}

}  // namespace lightmill
