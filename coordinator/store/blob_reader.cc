// How a BlobStore looks at what it holds.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "common/base/error.h"
#include "coordinator/store/blob_store.h"

namespace lightmill {
namespace {

constexpr size_t kVerifyChunk = size_t{1} << 20;

[[noreturn]] void reading_failed(const std::string& path) {
  throw Error(ErrorKind::kFailed, path + ": can't be read: " + std::strerror(errno));
}

}  // namespace

struct BlobStore::Reader::State {
  State() = default;
  ~State() {
    if (fd >= 0) close(fd);
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  BlobStore* store = nullptr;
  std::string digest, path, buffer;
  FileStamp stamp;  // when it was opened
  uint64_t read = 0;
  std::string failure;  // of the disk
  int fd = -1;
  Sha256 hash;
};

std::optional<BlobStore::Reader> BlobStore::open(const std::string& digest) {
  if (!contains(digest)) return std::nullopt;
  auto state = std::make_unique<Reader::State>();
  state->store = this;
  state->digest = digest;
  state->path = folder_ + "/" + digest;
  state->fd = ::open(state->path.c_str(), O_RDONLY | O_CLOEXEC);
  if (state->fd < 0 && errno == ENOENT) return std::nullopt;
  if (state->fd < 0) reading_failed(state->path);
  state->stamp = FileStamp::of(state->fd);
  return Reader(std::move(state));
}

BlobStore::Reader::Reader(std::unique_ptr<State> state) : state_(std::move(state)) {}

BlobStore::Reader::Reader(Reader&&) noexcept = default;

BlobStore::Reader& BlobStore::Reader::operator=(Reader&&) noexcept = default;

BlobStore::Reader::~Reader() = default;

uint64_t BlobStore::Reader::size() const {
  return static_cast<uint64_t>(std::max<off_t>(state_->stamp.size, 0));
}

std::string_view BlobStore::Reader::next(size_t most) {
  State& s = *state_;
  // Of a file that has grown no more is passed on than was announced; its stamp gives it away.
  s.buffer.resize(static_cast<size_t>(std::min<uint64_t>(most, size() - s.read)));
  if (s.buffer.empty() || !s.failure.empty()) return {};
  ssize_t n = -1;
  do {
    n = ::read(s.fd, s.buffer.data(), s.buffer.size());
  } while (n < 0 && errno == EINTR);
  if (n < 0 && errno != EIO) reading_failed(s.path);
  if (n <= 0) {
    s.failure = n < 0 ? std::strerror(EIO) : "the file ends too early";
    return {};
  }
  s.buffer.resize(static_cast<size_t>(n));
  s.hash.update(s.buffer);
  s.read += s.buffer.size();
  return s.buffer;
}

void BlobStore::Reader::read_from_disk() {
  // Advice, no more: pages that nobody has changed are let go.
  (void)posix_fadvise(state_->fd, 0, 0, POSIX_FADV_DONTNEED);
}

std::string BlobStore::Reader::damage() {
  State& s = *state_;
  if (!s.failure.empty()) return s.path + ": damaged: " + s.failure;
  if (s.read < size()) throw std::logic_error("a blob is judged once all of it was read");
  if (const std::string found = s.hash.hex(); found != s.digest) {
    return s.path + ": damaged: its " + std::to_string(s.read) + " bytes have the SHA-256 " +
           found.substr(0, 12) + "..., which is not its name";
  }
  return "";
}

bool BlobStore::Reader::finish() {
  State& s = *state_;
  const std::string why = damage();
  if (!why.empty()) {
    s.store->set_aside(s.digest, s.stamp, why);
  } else if (FileStamp::of(s.fd) == s.stamp) {
    s.store->remember(s.digest, s.stamp);
  }
  return why.empty();
}

bool BlobStore::verify(const std::string& digest) {
  if (is_verified(digest)) return true;
  std::optional<Reader> reader = open(digest);
  if (!reader) return false;
  while (!reader->next(kVerifyChunk).empty()) continue;
  return reader->finish();
}

bool BlobStore::contains(const std::string& digest, uint64_t size) {
  if (!contains(digest)) return false;
  const FileStamp file = FileStamp::of(folder_ + "/" + digest);
  return file.size >= 0 && static_cast<uint64_t>(file.size) == size ? true : verify(digest);
}

std::vector<std::string> BlobStore::missing(const std::vector<std::string>& digests, uint64_t bytes) {
  std::vector<std::string> missing;
  for (const std::string& digest : digests) {
    bool there = contains(digest);
    if (there && !is_verified(digest)) {
      const FileStamp file = FileStamp::of(folder_ + "/" + digest);
      const uint64_t blob = file.size > 0 ? static_cast<uint64_t>(file.size) : 0;
      if (blob <= bytes) {
        bytes -= blob;
        there = verify(digest);
      }
    }
    if (!there) missing.push_back(digest);
  }
  return missing;
}

}  // namespace lightmill
