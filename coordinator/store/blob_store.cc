#include "coordinator/store/blob_store.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "common/base/error.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;
constexpr const char* kTemporary = "incoming-";

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
  std::string folder, digest, temporary;
  uint64_t size = 0, written = 0;
  int fd = -1;
  Sha256 hash;
};

BlobStore::BlobStore(const std::string& folder) : folder_(folder) {
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
  state->folder = folder_;
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
  const std::string path = state_->folder + "/" + digest;
  if (rename(state_->temporary.c_str(), path.c_str()) != 0) disk_failed(path);
  close(state_->fd);
  const std::string folder = state_->folder;
  state_.reset();  // nothing is left to clean up
  sync_folder(folder);
}

}  // namespace lightmill
