#pragma once
// Blobs in a folder, each in a file named by its SHA-256. A file is written beside, verified, synced and
// renamed, so it is complete and right when it comes. The folder is its own index. Thread-safe.
//
//   BlobStore::Writer writer = blobs.begin(digest, size);
//   writer.write(chunk);  // any number of times
//   writer.finish();      // throws if size or digest do not fit
//
// Disks lose and change what they hold. So who reads a blob can look whether it is still right. One that is
// not goes out of the store at once and counts as missing, until somebody brings it again:
//
//   if (std::optional<BlobStore::Reader> blob = blobs.open(digest)) {
//     for (std::string_view bytes = blob->next(most); !bytes.empty(); bytes = blob->next(most)) ...
//     if (!blob->finish()) ...  // what was read is wrong, and the blob is gone
//   }
//
// The newest few that were damaged stay in the folder as `damaged-DIGEST`, to be looked at.
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "common/base/digest.h"
#include "common/base/file_stamp.h"

namespace lightmill {

class BlobStore {
 public:
  static constexpr uint64_t kMaxBlobBytes = uint64_t{64} << 30;
  /// What a caller who wants to send blobs has verified, a second's work or less: so whoever submits a scene
  /// again mends what is damaged. Scrubs, and workers that fetch it, look at the rest.
  static constexpr uint64_t kVerifyBytes = uint64_t{256} << 20;
  static constexpr size_t kMostDamagedKept = 8;
  static constexpr uint64_t kMostDamagedBytes = uint64_t{1} << 30;  // of these; the newest stays in any case

  /// Makes the folder if it is absent. Removes files that a crash left half-written. `log` receives a line
  /// about each damaged blob, from any thread.
  explicit BlobStore(const std::string& folder, std::function<void(const std::string&)> log = {});

  bool contains(const std::string& digest) const;
  /// The same for one of so many bytes. One of another size is damaged, and goes.
  bool contains(const std::string& digest, uint64_t size);
  /// Path of a blob that is there. Throws Error(kFailed) if it isn't, Error(kUsage) if that is not a digest.
  std::string path(const std::string& digest) const;
  uint64_t size(const std::string& digest) const;
  /// All that are there, ascending.
  std::vector<std::string> digests() const;

  /// True if the blob is there and right. Reads it, unless its file is as it was when it was last read.
  bool verify(const std::string& digest);
  /// Those that are not there, in the order asked. Verifies those whose files are new to this process or have
  /// changed, while together they have at most `bytes` bytes.
  std::vector<std::string> missing(const std::vector<std::string>& digests, uint64_t bytes);
  /// Blobs that were found damaged since the start.
  uint64_t damaged() const { return damaged_; }

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

  /// One blob that is being read.
  class Reader {
   public:
    Reader(Reader&&) noexcept;
    Reader& operator=(Reader&&) noexcept;
    ~Reader();
    /// Bytes, when it was opened.
    uint64_t size() const;
    /// The next bytes, at most `most`, good until the next call; empty at the end. Throws Error(kFailed) if
    /// this process can't read now; what the disk can't read is damage, and ends it.
    std::string_view next(size_t most);
    /// Reads what the disk holds, in place of what the system has in memory of it.
    void read_from_disk();
    /// Once all was read: what is wrong with the blob, in one line; empty if it is right.
    std::string damage();
    /// The same for the store: false if the blob is damaged, and it is not in the store any more.
    bool finish();

   private:
    friend class BlobStore;
    struct State;
    explicit Reader(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
  };
  /// Empty if the blob is not there.
  std::optional<Reader> open(const std::string& digest);

 private:
  bool is_verified(const std::string& digest) const;
  void remember(const std::string& digest, const FileStamp& stamp);
  void set_aside(const std::string& digest, const FileStamp& read, const std::string& why);
  void drop_old_damaged() const;

  const std::string folder_;
  const std::function<void(const std::string&)> log_;
  std::atomic<uint64_t> damaged_{0};
  mutable std::mutex mutex_;  // held while a file comes in or goes out; never while one is read
  std::unordered_map<std::string, FileStamp> verified_;  // guarded by mutex_: files that were right
};

}  // namespace lightmill
