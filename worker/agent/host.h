#pragma once
// What this machine offers.
#include <sched.h>
#include <unistd.h>

#include <string>
#include <thread>

namespace lightmill::agent {

/// Processors that this process may run on; at least 1.
inline int usable_threads() {
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof set, &set) == 0 && CPU_COUNT(&set) > 0) return CPU_COUNT(&set);
  const unsigned threads = std::thread::hardware_concurrency();
  return threads > 0 ? static_cast<int>(threads) : 1;
}

inline std::string host_name() {
  char name[256] = "";
  if (gethostname(name, sizeof name - 1) != 0) return "unknown";
  return name;
}

}  // namespace lightmill::agent
