#pragma once
// The jobs of which somebody wants a picture that takes long to make: few, and each once.
#include <cstddef>
#include <deque>
#include <optional>

#include "common/base/ids.h"

namespace lightmill {

class Wishes {
 public:
  static constexpr size_t kMost = 16;         // further ones are asked for again
  static constexpr size_t kRemembered = 256;  // jobs whose turns are known

  /// Makes it the newest; the oldest one goes if there are too many.
  void add(const JobId& job);
  /// Takes the one whose last turn is longest ago, so that one job which is asked for all the time keeps no
  /// other from its turn. Of those without one the newest: it is what somebody has just begun to look at.
  std::optional<JobId> take();
  /// It has been fulfilled.
  void remove(const JobId& job) { std::erase(wanted_, job); }
  bool empty() const { return wanted_.empty(); }
  size_t size() const { return wanted_.size(); }

 private:
  std::deque<JobId> wanted_;  // the newest last
  std::deque<JobId> turns_;   // of take(); the last one last
};

}  // namespace lightmill
