#pragma once
// Keeps refused partials in a folder, for people to look at: the bytes of each and a text that says who sent
// them, for which lease, and why they were refused. Only the newest are kept. Thread-safe.
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>

#include "common/farm/farm_types.h"

namespace lightmill {

class Quarantine {
 public:
  static constexpr size_t kMostEntries = 32;
  static constexpr uint64_t kMostBytes = uint64_t{64} << 20;  // of all entries; longer partials are cut

  /// Makes the folder if it is absent. Throws Error(kFailed).
  explicit Quarantine(const std::string& folder);
  /// Keeps one and deletes the oldest beyond the bounds. Throws Error(kFailed) if it can't be written.
  void keep(const LeaseKey& lease, const WorkerId& worker, const std::string& reason, std::string_view bytes);

 private:
  void make_room(uint64_t bytes);

  std::mutex mutex_;
  std::string folder_;
  uint64_t next_ = 1;
};

}  // namespace lightmill
