#include "common/base/load_guard.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace lightmill {
namespace {

/// Signal-safe.
[[noreturn]] void give_up() {
  const auto say = [](const char* text) {
    if (write(STDERR_FILENO, text, std::strlen(text)) < 0) _exit(1);
  };
  say(program_invocation_short_name);
  say(": its libraries can't start: too little memory, or too few threads, are allowed; raise the limits "
      "(ulimit -d, -v and -u, or the container's)\n");
  _exit(1);
}

void on_signal(int) { give_up(); }

}  // namespace

void LoadWatch::begin() {
  terminate_ = std::set_terminate(give_up);
  struct sigaction action {};
  action.sa_handler = on_signal;
  for (size_t i = 0; i < kCrashSignals.size(); ++i) sigaction(kCrashSignals[i], &action, &actions_[i]);
}

void LoadWatch::end() {
  if (std::get_terminate() == give_up) std::set_terminate(terminate_);
  for (size_t i = 0; i < kCrashSignals.size(); ++i) {
    struct sigaction now {};
    if (sigaction(kCrashSignals[i], nullptr, &now) == 0 && now.sa_handler == on_signal)
      sigaction(kCrashSignals[i], &actions_[i], nullptr);
  }
}

}  // namespace lightmill
