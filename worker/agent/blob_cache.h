#pragma once
// Verified blobs of scene bundles on this worker's disk, kept within a size.
#include <cstdint>
#include <set>
#include <string>

#include "common/scene/bundle.h"
#include "worker/agent/farm_link.h"

namespace lightmill::agent {

class BlobCache {
 public:
  /// `folder` is made if absent. Throws Error(kFailed) if it can't be written to. Several workers of a host
  /// may share one.
  BlobCache(std::string folder, uint64_t max_bytes);
  /// Makes every blob of `bundle` present and verified, fetching what is missing; least
  /// recently used blobs of other bundles go if room is needed. Throws Error(kFailed) if the
  /// bundle alone is larger than the cache, the disk fails, or a blob's content does not match
  /// its digest; LinkDown if it can't be fetched now.
  void ensure(const Bundle& bundle, FarmLink& link);
  /// A file that is named for this blob; empty: none is here. Any thread.
  std::string find(const std::string& digest) const;
  /// The blobs, under `blob_file_name`.
  const std::string& folder() const { return folder_; }

 private:
  bool is_present(const BundleEntry& entry);
  void make_room(const Bundle& bundle, uint64_t missing_bytes);

  std::string folder_;
  uint64_t max_bytes_;
  std::set<std::string> verified_;  // file names whose content this process has hashed
};

}  // namespace lightmill::agent
