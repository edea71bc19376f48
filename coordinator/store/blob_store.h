#pragma once
// Blobs in a folder, each in a file named by its SHA-256. A file that is there is complete and right, because
// it is written beside, verified, synced and renamed. So the folder is its own index. Thread-safe.
//
//   BlobStore::Writer writer = blobs.begin(digest, size);
//   writer.write(chunk);  // any number of times
//   writer.finish();      // throws if size or digest do not fit
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "common/base/digest.h"

namespace lightmill {

class BlobStore {
 public:
  static constexpr uint64_t kMaxBlobBytes = uint64_t{64} << 30;

  /// Makes the folder if it is absent. Removes files that a crash left half-written.
  explicit BlobStore(const std::string& folder);

  bool contains(const std::string& digest) const;
  /// Path of a blob that is there. Throws Error(kFailed) if it isn't, Error(kUsage) if that is not a digest.
  std::string path(const std::string& digest) const;
  uint64_t size(const std::string& digest) const;

  /// One blob that is being received. If it isn't finished it leaves nothing behind.
  class Writer {
   public:
    Writer(Writer&&) noexcept;
    ~Writer();
    /// Throws Error(kUsage) beyond the announced size, Error(kFailed) if the disk fails.
    void write(std::string_view chunk);
    /// Verifies, syncs and renames.
    void finish();

   private:
    friend class BlobStore;
    struct State;
    explicit Writer(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
  };
  Writer begin(const std::string& digest, uint64_t size);

 private:
  std::string folder_;
};

}  // namespace lightmill
