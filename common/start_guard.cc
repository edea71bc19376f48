#include "common/start_guard.h"

#include <signal.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <exception>

namespace lightmill {
namespace {

constexpr std::array kSignals{SIGABRT, SIGBUS, SIGSEGV};

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

std::terminate_handler terminate_before = nullptr;

void watch() {
  terminate_before = std::set_terminate(give_up);
  struct sigaction action {};
  action.sa_handler = on_signal;
  for (const int number : kSignals) sigaction(number, &action, nullptr);
}

// Runs before the constructors of shared libraries, as only this section of a program does.
[[gnu::section(".preinit_array"), gnu::used]] void (*const watch_from_the_start)() = watch;

}  // namespace

void started() {
  std::set_terminate(terminate_before);
  for (const int number : kSignals) {
    struct sigaction now {};
    // A sanitizer's handlers stay.
    if (sigaction(number, nullptr, &now) == 0 && now.sa_handler == on_signal) signal(number, SIG_DFL);
  }
}

}  // namespace lightmill
