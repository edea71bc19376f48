#pragma once
// A line instead of a bare signal where libraries kill the program while they are loaded.
//
// OpenImageIO and the three hundred libraries behind it start threads and take memory while they are loaded.
// Where a limit of the system is in their way (ulimit -d, -v, -u, or a container's), they throw, abort or
// crash. Under a guard such an end prints one line to stderr, and the exit code is 1.
#include <signal.h>

#include <array>
#include <exception>

namespace lightmill {

/// What a crash raises.
inline constexpr std::array kCrashSignals{SIGABRT, SIGBUS, SIGSEGV};

/// From begin() to end(), in all threads. Handlers that a library, or a sanitizer, puts in place meanwhile
/// stay.
class LoadWatch {
 public:
  void begin();
  void end();

 private:
  std::terminate_handler terminate_ = nullptr;
  std::array<struct sigaction, kCrashSignals.size()> actions_{};
};

/// A watch for a scope.
class LoadGuard {
 public:
  LoadGuard() { watch_.begin(); }
  ~LoadGuard() { watch_.end(); }
  LoadGuard(const LoadGuard&) = delete;
  LoadGuard& operator=(const LoadGuard&) = delete;

 private:
  LoadWatch watch_;
};

}  // namespace lightmill
