#include "common/base/start_guard.h"

#include "common/base/load_guard.h"

namespace lightmill {
namespace {

// No constructor of it runs later: the watch begins before any does.
constinit LoadWatch start_watch;

// Runs before the constructors of shared libraries, as only this section of a program does.
[[gnu::section(".preinit_array"), gnu::used]] void (*const watch_from_the_start)() = [] {
  start_watch.begin();
};

}  // namespace

void started() { start_watch.end(); }

}  // namespace lightmill
