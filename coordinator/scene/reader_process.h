#pragma once
// Reads scenes of strangers in a process of its own: one that can only read files, that ends with a bound on
// memory and time, and whose crash is an answer like any other.
//
//   ReaderProcess reader({"/proc/self/exe", "read-scene"}, {});
//   SceneAnswer answer = reader.read(question);
//   int main() { return read_scene_and_answer(limits); }   // of "read-scene"
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "coordinator/scene/scene_reader.h"

namespace lightmill {

struct ReaderLimits {
  uint64_t memory_bytes = uint64_t{4} << 30;
  double seconds = 120;  // of the clock, and of one processor on each
};

/// Thread-safe.
class ReaderProcess {
 public:
  /// `command`: the program, and what makes it call read_scene_and_answer with the same limits.
  ReaderProcess(std::vector<std::string> command, const ReaderLimits& limits)
      : command_(std::move(command)), limits_(limits) {}
  /// Throws Error(kBadScene) if the scene needs more than the limits or kills its reader, Error(kUsage) as
  /// read_scene, Error(kFailed) if no process can be started, or after stop().
  SceneAnswer read(const SceneQuestion& question) const;
  /// Makes every read() in progress and later give up at once: the program is shutting down.
  void stop() { stopping_ = true; }

 private:
  std::atomic<bool> stopping_{false};
  std::vector<std::string> command_;
  ReaderLimits limits_;
};

/// The process's part: a question on stdin, the answer on stdout. Returns its exit code.
int read_scene_and_answer(const ReaderLimits& limits);

}  // namespace lightmill
