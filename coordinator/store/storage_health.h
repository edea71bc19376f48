#pragma once
// Whether the store works. After a failure nothing is leased and no commit is tried, so that a full disk
// costs no work. A probe tries again and again until the store is mended. Thread-safe; time is an argument.
#include <mutex>
#include <optional>
#include <string>

namespace lightmill {

class StorageHealth {
 public:
  /// A write or a read failed. The first failure counts as the reason.
  void failed(const std::string& reason, double now);
  /// A probe succeeded. Returns whether there was a fault.
  bool mended();
  /// Why the store is not used at present, one line; empty while it works.
  std::optional<std::string> fault() const;
  /// Whether there is a fault and it is time for a probe; if so, sets the time of the next one.
  bool take_probe(double now);

 private:
  static constexpr double kFirstProbeSeconds = 0.25, kLongestProbeSeconds = 4;
  mutable std::mutex mutex_;
  std::optional<std::string> fault_;
  double next_probe_ = 0, pause_ = kFirstProbeSeconds;
};

}  // namespace lightmill
