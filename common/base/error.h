#pragma once
// Errors that a user can cause: bad input, an unreachable peer, a disk that is full.
//
// Policy: external input -> throw Error with one line that says what, where and how to mend it;
// an impossible state -> assert / std::logic_error. `main` of every program prints
// `Error::what()` to stderr and exits with `exit_code()`.
//
//   throw Error(ErrorKind::kBadScene, "scene.pbrt:12:3: unknown shape \"sphear\"; did you mean \"sphere\"?");
#include <stdexcept>
#include <string>

namespace lightmill {

enum class ErrorKind {
  kFailed,       // exit 1: the job failed, the output can't be written, an unknown job
  kUsage,        // exit 2: a wrong command line
  kBadScene,     // exit 2: a scene (or anything it references) that can't be rendered
  kUnreachable,  // exit 3: the coordinator can't be reached or refuses us
};

/// A one-line, user-facing error.
class Error : public std::runtime_error {
 public:
  Error(ErrorKind kind, const std::string& message) : std::runtime_error(message), kind_(kind) {}
  ErrorKind kind() const { return kind_; }
  /// The process exit code of the CLI contract: 1, 2 or 3.
  int exit_code() const;

 private:
  ErrorKind kind_;
};

/// Throws Error(kBadScene).
[[noreturn]] inline void fail_scene(const std::string& message) {
  throw Error(ErrorKind::kBadScene, message);
}

}  // namespace lightmill
