#include "coordinator/store/blob_store.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "common/base/error.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;
constexpr const char* kTemporary = "incoming-";
constexpr const char* kDamaged = "damaged-";
/// Files that are remembered as right. Beyond it memory begins anew, which costs reading them again.
constexpr size_t kMostRemembered = 200'000;

[[noreturn]] void disk_failed(const std::string& path) {
  throw Error(ErrorKind::kFailed, path + ": can't store the blob: " + std::strerror(errno));
}

void sync_folder(const std::string& folder) {
  const int fd = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) disk_failed(folder);
  const int result = fsync(fd);
  close(fd);
  if (result != 0) disk_failed(folder);
}

void require_digest(const std::string& digest) {
  if (!is_sha256_hex(digest)) {
    throw Error(ErrorKind::kUsage, "a blob is named by 64 lower-case hex digits, the SHA-256 of its content");
  }
}

}  // namespace

struct BlobStore::Writer::State {
  BlobStore* store = nullptr;
  std::string digest, temporary;
  uint64_t size = 0, written = 0;
  int fd = -1;
  Sha256 hash;
};

BlobStore::BlobStore(const std::string& folder, std::function<void(const std::string&)> log)
    : folder_(folder), log_(std::move(log)) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw Error(ErrorKind::kFailed, folder + ": can't make the folder: " + error.message());
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().filename().string().starts_with(kTemporary)) fs::remove(entry.path(), error);
  }
}

bool BlobStore::contains(const std::string& digest) const {
  require_digest(digest);
  std::error_code error;
  return fs::is_regular_file(folder_ + "/" + digest, error);
}

std::string BlobStore::path(const std::string& digest) const {
  if (!contains(digest)) throw Error(ErrorKind::kFailed, "the coordinator has no blob " + digest);
  return folder_ + "/" + digest;
}

uint64_t BlobStore::size(const std::string& digest) const {
  std::error_code error;
  const uint64_t size = fs::file_size(path(digest), error);
  if (error) throw Error(ErrorKind::kFailed, "blob " + digest + ": " + error.message());
  return size;
}

BlobStore::Writer BlobStore::begin(const std::string& digest, uint64_t size) {
  require_digest(digest);
  if (size > kMaxBlobBytes) throw Error(ErrorKind::kUsage, "blob " + digest + " is larger than 64 GiB");
  auto state = std::make_unique<Writer::State>();
  state->store = this;
  state->digest = digest;
  state->size = size;
  state->temporary = folder_ + "/" + kTemporary + "XXXXXX";
  state->fd = mkostemp(state->temporary.data(), O_CLOEXEC);
  if (state->fd < 0) disk_failed(state->temporary);
  return Writer(std::move(state));
}

BlobStore::Writer::Writer(std::unique_ptr<State> state) : state_(std::move(state)) {}

BlobStore::Writer::Writer(Writer&&) noexcept = default;

BlobStore::Writer::~Writer() {
  if (!state_) return;
  close(state_->fd);
  unlink(state_->temporary.c_str());
}

void BlobStore::Writer::write(std::string_view chunk) {
  if (chunk.size() > state_->size - state_->written) {
    throw Error(ErrorKind::kUsage, "blob " + state_->digest + " is longer than announced");
  }
  state_->hash.update(chunk);
  state_->written += chunk.size();
  while (!chunk.empty()) {
    const ssize_t n = ::write(state_->fd, chunk.data(), chunk.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) disk_failed(state_->temporary);
    chunk.remove_prefix(static_cast<size_t>(n));
  }
}

void BlobStore::Writer::finish() {
  const std::string& digest = state_->digest;
  if (state_->written != state_->size)
    throw Error(ErrorKind::kUsage, "blob " + digest + " is shorter than announced");
  if (state_->hash.hex() != digest) {
    throw Error(ErrorKind::kUsage,
                "blob " + digest + " arrived with another digest; did the file change meanwhile?");
  }
  if (fsync(state_->fd) != 0) disk_failed(state_->temporary);
  BlobStore& store = *state_->store;
  const std::string path = store.folder_ + "/" + digest;
  {
    const std::lock_guard lock(store.mutex_);
    if (rename(state_->temporary.c_str(), path.c_str()) != 0) disk_failed(path);
  }
  store.remember(digest, FileStamp::of(state_->fd));
  close(state_->fd);
  state_.reset();  // nothing is left to clean up
  sync_folder(store.folder_);
}

std::vector<std::string> BlobStore::digests() const {
  std::vector<std::string> digests;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error)) {
    std::string name = entry.path().filename().string();
    if (is_sha256_hex(name)) digests.push_back(std::move(name));
  }
  std::sort(digests.begin(), digests.end());
  return digests;
}

bool BlobStore::is_verified(const std::string& digest) const {
  const FileStamp now = FileStamp::of(folder_ + "/" + digest);
  const std::lock_guard lock(mutex_);
  const auto found = verified_.find(digest);
  return found != verified_.end() && found->second == now;
}

void BlobStore::remember(const std::string& digest, const FileStamp& stamp) {
  const std::lock_guard lock(mutex_);
  if (verified_.size() >= kMostRemembered) verified_.clear();
  verified_[digest] = stamp;
}

void BlobStore::set_aside(const std::string& digest, const FileStamp& read, const std::string& why) {
  const std::string path = folder_ + "/" + digest, kept = folder_ + "/" + kDamaged + digest;
  {
    const std::lock_guard lock(mutex_);
    verified_.erase(digest);
    // A good one may have come meanwhile.
    const FileStamp now = FileStamp::of(path);
    if (now.inode != read.inode || now.device != read.device) return;
    if (rename(path.c_str(), kept.c_str()) != 0 && unlink(path.c_str()) != 0) disk_failed(path);
    ++damaged_;
  }
  drop_old_damaged();
  if (log_) log_(why + "; it is needed again from a client or worker that has it");
}

void BlobStore::drop_old_damaged() const {
  struct Kept {
    fs::path path;
    struct timespec since;
    uint64_t bytes;
  };
  std::vector<Kept> all;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error)) {
    struct stat s {};
    if (!entry.path().filename().string().starts_with(kDamaged)) continue;
    if (stat(entry.path().c_str(), &s) == 0)
      all.push_back({entry.path(), s.st_ctim, static_cast<uint64_t>(s.st_size)});
  }
  std::sort(all.begin(), all.end(), [](const Kept& a, const Kept& b) {
    return std::pair(a.since.tv_sec, a.since.tv_nsec) > std::pair(b.since.tv_sec, b.since.tv_nsec);
  });
  uint64_t bytes = 0;
  for (size_t i = 0; i < all.size(); ++i) {
    bytes += all[i].bytes;
    if (i >= kMostDamagedKept || (i > 0 && bytes > kMostDamagedBytes)) fs::remove(all[i].path, error);
  }
}

}  // namespace lightmill
