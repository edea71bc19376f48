#pragma once
// Which blobs the coordinator has lost that jobs need. The farm is told, so that those jobs say so. Workers
// are told, and who has such a blob hands it in.
//
//   WantedBlobs wanted(farm, blobs, clock);
//   wanted.look_around();             // in the background: one bundle after the other, those with gaps often
//   wanted.missed(bundle);            // a worker got NOT_FOUND
//   auto claim = wanted.claim(digest);  // one worker at a time brings it
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "coordinator/core/farm.h"
#include "coordinator/store/blob_store.h"

namespace lightmill {

/// Thread-safe.
class WantedBlobs {
 public:
  static constexpr size_t kMostNamed = 16;      // to a worker at once, and of a bundle
  static constexpr size_t kMostBundles = 1000;  // whose gaps are remembered
  static constexpr double kLookSeconds = 1;
  /// Who brings a blob that slowly lets others try as well, up to so many.
  static constexpr double kClaimSeconds = 60;
  static constexpr int kMostClaims = 4;

  /// All must outlive this object.
  WantedBlobs(Farm& farm, BlobStore& blobs, const Clock& clock) : farm_(farm), blobs_(blobs), clock_(clock) {}

  /// Looks at the bundles that had gaps, and at the next one of those of jobs that have not ended.
  void look_around();
  /// A worker has asked for a file of this bundle in vain.
  void missed(const std::string& bundle_digest) { look(bundle_digest, true); }
  /// Digests of blobs that nobody is bringing, at most kMostNamed.
  std::vector<std::string> named() const;

  /// The right to bring a blob, until it goes out of scope.
  class Claim {
   public:
    Claim(WantedBlobs* wanted, std::string digest, uint64_t size)
        : size(size), wanted_(wanted), digest_(std::move(digest)) {}
    ~Claim();
    Claim(const Claim&) = delete;
    Claim& operator=(const Claim&) = delete;
    const uint64_t size;  // that it must have

   private:
    WantedBlobs* wanted_;
    const std::string digest_;
  };
  /// Null if the blob is not wanted, or somebody is bringing it.
  std::unique_ptr<Claim> claim(const std::string& digest);
  /// A blob has come: the jobs that waited for it go on.
  void arrived(const std::string& digest);

 private:
  using Gaps = std::map<std::string, uint64_t>;  // digest -> size, at most kMostNamed
  void look(const std::string& bundle_digest, bool in_vain);
  void remember(const std::string& bundle_digest, Gaps gaps);
  std::optional<std::string> next_bundle();

  /// Somebody is bringing it, and fast enough so far. Wants mutex_ held.
  bool is_coming(const std::string& digest) const;

  Farm& farm_;
  BlobStore& blobs_;
  const Clock& clock_;
  std::atomic<bool> any_{false};  // gaps: most calls need no lock
  mutable std::mutex mutex_;      // never held while the disk is asked
  // Guarded by mutex_.
  std::map<std::string, Gaps> gaps_;  // by bundle
  struct Coming {
    int claims = 0;
    double since = 0;  // of the newest
  };
  std::map<std::string, Coming> coming_;
  std::vector<std::string> round_;  // bundles yet to be looked at, the next one last
};

}  // namespace lightmill
