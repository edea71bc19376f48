#pragma once
// Reads all blobs again and again, slowly, so that damage is found before somebody needs the blob. What is
// damaged goes out of the store (blob_store.h).
//
//   BlobScrub scrub(blobs, 4e6, log);
//   for (;;) sleep(scrub.step(clock.now()));  // Background (coordinator/service/background.h) does
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "coordinator/store/blob_store.h"

namespace lightmill {

class BlobScrub {
 public:
  static constexpr size_t kStepBytes = size_t{256} << 10;
  /// A pass over a small store would otherwise begin again at once.
  static constexpr double kPassSeconds = 3600;

  /// `bytes_per_second` above 0. `blobs` must outlive this object. `log` receives what can't be read.
  BlobScrub(BlobStore& blobs, double bytes_per_second, std::function<void(const std::string&)> log = {});
  /// Reads the next few bytes, at most kStepBytes. The time from now, in seconds, at which the next step is
  /// due.
  double step(double now);

 private:
  /// Bytes that were read.
  size_t read();

  BlobStore& blobs_;
  const double bytes_per_second_;
  const std::function<void(const std::string&)> log_;
  std::vector<std::string> left_;  // of this pass, the next one last
  std::optional<BlobStore::Reader> open_;
  double pass_begun_ = 0;
  bool in_pass_ = false;
};

}  // namespace lightmill
