// Modules that are not to be loaded, one for each value of FAKE.
#include <csignal>
#include <cstdlib>
#include <new>

#include "common/build_id/build_id.h"
#include "common/image/image_library.h"

namespace {

enum Fake { kOtherBuild, kOtherVersion, kStranger, kThrows, kAborts, kCrashes };

/// Waits for ever, as a pool does that can't end its threads.
struct NeverDestroyed {
  ~NeverDestroyed() {
    for (;;) {
    }
  }
};

[[gnu::constructor]] void start() {
  if (FAKE == kThrows) {
    const NeverDestroyed pool;
    throw std::bad_alloc();
  }
  if (FAKE == kAborts) std::abort();
  if (FAKE == kCrashes) std::raise(SIGSEGV);
}

}  // namespace

#if FAKE != 2  // a stranger has no such function
extern "C" const lightmill::ImageLibrary* lightmill_images() {
  static const std::string build = lightmill::build_id();
  static lightmill::ImageLibrary library{};
  library.build = FAKE == kOtherBuild ? "lightmill 0.0.0" : build.c_str();
  library.version_built = "2.0.1";
  library.version_running = FAKE == kOtherVersion ? "2.0.2" : "2.0.1";
  return &library;
}
#endif
