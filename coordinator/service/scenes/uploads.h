#pragma once
// Files that come in pieces over HTTP, each in requests that no proxy finds too large. A piece that is lost
// or comes twice does no harm: every answer says how far the file is, and the sender goes on from there.
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "coordinator/store/blob_store.h"

namespace lightmill {

/// Thread-safe.
class Uploads {
 public:
  /// Of one piece; what web servers in between usually take.
  static constexpr size_t kPieceBytes = size_t{1} << 20;
  /// Begun and not finished at a time, of all users together.
  static constexpr size_t kMaxOpen = 32;
  /// One that nobody goes on with gives its place to another after this.
  static constexpr double kIdleSeconds = 60;

  Uploads(BlobStore& blobs, uint64_t max_bytes) : blobs_(blobs), max_bytes_(max_bytes) {}

  struct Progress {
    uint64_t received = 0;  // bytes from the beginning
    bool complete = false;  // stored, and of the digest that it was announced with
  };
  /// Takes `bytes` if they go on where the file of that digest and size is; ignores them otherwise. Nothing
  /// is ever removed by it: `user`s have their own beginnings of a file. `now`: seconds of a steady clock.
  /// Throws LimitReached for a file that is too large, or while too many are open; Error(kUsage) for what is
  /// no digest, and when the content is not that of the digest, which begins anew then; Error(kFailed) if the
  /// disk fails.
  Progress put(const std::string& user, const std::string& digest, uint64_t size, uint64_t offset,
               std::string_view bytes, double now);

 private:
  struct Open {
    Open(BlobStore::Writer to, uint64_t of_size) : size(of_size), writer(std::move(to)) {}
    const uint64_t size;
    double last = 0;   // guarded by the mutex of all
    std::mutex mutex;  // of the members below; taken before the mutex of all
    BlobStore::Writer writer;
    uint64_t received = 0;
    bool ended = false;
  };
  using Key = std::pair<std::string, std::string>;  // user, digest
  std::shared_ptr<Open> open(const Key& key, uint64_t size, double now);

  BlobStore& blobs_;
  const uint64_t max_bytes_;
  std::mutex mutex_;
  std::map<Key, std::shared_ptr<Open>> open_;
};

}  // namespace lightmill
