#include "common/image/image_library.h"

#include <dlfcn.h>
#include <pthread.h>
#include <signal.h>

#include <algorithm>
#include <filesystem>
#include <thread>

#include "common/base/error.h"
#include "common/base/load_guard.h"
#include "common/build_id/build_id.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;

constexpr const char* kModule = "lightmill-images.so";
constexpr const char* kEntry = "lightmill_images";

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
  throw Error(ErrorKind::kFailed, path + ": the module that reads and writes images " + why);
}

/// Threads that the libraries start inherit what is blocked here: signals to the program are not for them.
/// Those that tell of a crash stay, for the guard.
class SignalsBlocked {
 public:
  SignalsBlocked() {
    sigset_t all;
    sigfillset(&all);
    for (const int number : kCrashSignals) sigdelset(&all, number);
    pthread_sigmask(SIG_BLOCK, &all, &before_);
  }
  ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;

 private:
  sigset_t before_;
};

/// Null, with a reason in `why`, if it can't be.
///
/// A thread of its own: one that nothing would catch an exception of, so that a library's constructor which
/// throws ends the program at once, as the guard says. On the way to a handler the library's destructors
/// would run, one of which waits for ever, and no handler can leave dlopen. What libraries built for speed do
/// to the floating-point mode ends with the thread, too.
void* open_library(const std::string& path, std::string* why) {
  void* module = nullptr;
  const SignalsBlocked blocked;
  const LoadGuard guard;
  std::thread([&] {
    module = dlopen(path.c_str(), RTLD_LAZY | RTLD_LOCAL);
    if (!module) *why = dlerror();
  }).join();
  std::replace(why->begin(), why->end(), '\n', ' ');
  return module;
}

/// Beside the program, where it was built or copied to; else in ../lib/lightmill, where it was installed. The
/// program's own path is the real one, whatever link it was started by.
std::string module_of_program() {
  std::error_code ec;
  const fs::path program = fs::read_symlink("/proc/self/exe", ec);
  if (ec)
    refuse(kModule, "can't be looked for: /proc/self/exe can't be read (" + ec.message() + "); mount /proc");
  const fs::path folder = program.parent_path();
  const fs::path beside = folder / kModule, installed = folder.parent_path() / "lib/lightmill" / kModule;
  return (fs::exists(beside, ec) || !fs::exists(installed, ec) ? beside : installed).string();
}

struct Outcome {
  const ImageLibrary* library = nullptr;
  std::string why;
};

Outcome load_of_program() {
  try {
    return {&load_image_library(module_of_program()), ""};
  } catch (const Error& e) {
    return {nullptr, e.what()};
  }
}

}  // namespace

const ImageLibrary& load_image_library(const std::string& path) {
  std::error_code ec;
  if (!fs::exists(path, ec))
    refuse(path, "is not there; copy it from where the program comes from, or build it");
  std::string why;
  void* const module = open_library(path, &why);
  if (!module) {
    refuse(path,
           "can't be loaded: " + why +
               "; install the libraries that it names, or raise the limits on memory (ulimit -d and -v)");
  }
  const auto entry = reinterpret_cast<const ImageLibrary* (*)()>(dlsym(module, kEntry));
  if (!entry) refuse(path, "is something else; copy it from where the program comes from, or build it");
  const ImageLibrary& library = *entry();
  if (library.build != build_id()) {
    refuse(path, "is of another build (" + std::string(library.build) + ") than the program (" + build_id() +
                     "); copy both from one build");
  }
  if (std::string(library.version_running) != library.version_built) {
    refuse(path, "was built with OpenImageIO " + std::string(library.version_built) + " and runs with " +
                     library.version_running +
                     ", which may read other values; install the former, or build again");
  }
  return library;
}

const ImageLibrary& image_library() {
  static const Outcome outcome = load_of_program();
  if (!outcome.library) throw Error(ErrorKind::kFailed, outcome.why);
  return *outcome.library;
}

}  // namespace lightmill
