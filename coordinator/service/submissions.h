#pragma once
// What comes with a new job, or with new frames of a sequence: a manifest whose files must be there.
#include <atomic>
#include <memory>
#include <optional>
#include <semaphore>
#include <set>
#include <string>

#include "common/scene/bundle.h"
#include "coordinator/service/limits/in_flight_limit.h"
#include "coordinator/store/blob_store.h"

namespace lightmill {

/// A bundle from its manifest. Throws Error(kUsage) if it is malformed.
Bundle read_manifest(const std::string& text);

/// Throws unless the store has all files of the bundle, of the right sizes: Error(kFailed) for one that was
/// not uploaded or is damaged, Error(kUsage) for a size that is wrong. `known`, if given, has the digests
/// that were looked at before, and receives these.
void require_files(BlobStore& blobs, const Bundle& bundle, std::set<std::string>* known = nullptr);

/// Manifests take several times their bytes while they are unpacked: large ones are unpacked one at a time.
class SubmissionGate {
 public:
  class Pass {
   public:
    /// Waits some seconds where it has to. Throws LimitReached if that is not enough, or if too many wait.
    Pass(SubmissionGate& gate, size_t bytes);

   private:
    std::optional<Slot> slot_;
    std::optional<Turn> turn_;
  };

 private:
  std::counting_semaphore<> large_{1};
  std::atomic<int> waiting_{0};
};

}  // namespace lightmill
