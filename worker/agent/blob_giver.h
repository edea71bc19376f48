#pragma once
// Hands in the blobs that the coordinator has lost and this worker has.
#include <functional>
#include <map>
#include <string>

#include "worker/agent/farm_link.h"
#include "worker/agent/packet_renderer.h"

namespace lightmill::agent {

/// For one thread, which may wait for a transfer as long as it takes.
class BlobGiver {
 public:
  /// After a try a blob is left alone so long: another worker may be bringing it.
  static constexpr double kPauseSeconds = 15;

  /// Both must outlive this object.
  BlobGiver(FarmLink& link, const RenderSource& source, std::function<void(const std::string&)> log);
  /// Gives what was asked for since the last call. `now`, in seconds, never falls.
  void give(double now);

 private:
  void give(const std::string& digest);

  FarmLink& link_;
  const RenderSource& source_;
  const std::function<void(const std::string&)> log_;
  std::map<std::string, double> tried_;  // digest -> when
};

}  // namespace lightmill::agent
