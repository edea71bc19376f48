#include "coordinator/store/layer_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "common/base/digest.h"
#include "coordinator/store/job_store.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;

/// Closes on the way out; close() says whether it worked.
class File {
 public:
  File(const std::string& path, int flags) : fd_(open(path.c_str(), flags | O_CLOEXEC, 0644)) {}
  ~File() {
    if (fd_ >= 0) ::close(fd_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  int fd() const { return fd_; }
  bool close() {
    const int fd = fd_;
    fd_ = -1;
    return ::close(fd) == 0;
  }

 private:
  int fd_;
};

bool write_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    bytes.remove_prefix(static_cast<size_t>(n));
  }
  return true;
}

bool is_folder_synced(const std::string& path) {
  const File folder(path, O_RDONLY | O_DIRECTORY);
  return folder.fd() >= 0 && fsync(folder.fd()) == 0;
}

}  // namespace

LayerFiles::LayerFiles(const std::string& folder) : folder_(folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw StoreError(folder + ": can't make the folder: " + error.message());
}

void LayerFiles::put(const std::string& name, std::string_view bytes) const {
  const std::string path = folder_ + "/" + name;
  // Nothing reads it under this name before its row is there, so it need not be renamed.
  File file(path, O_WRONLY | O_CREAT | O_TRUNC);
  if (file.fd() < 0 || !write_all(file.fd(), bytes) || fsync(file.fd()) != 0 || !file.close() ||
      !is_folder_synced(folder_)) {
    const std::string why = std::strerror(errno);
    unlink(path.c_str());
    throw StoreError(path + ": can't be written: " + why);
  }
}

std::string LayerFiles::get(const std::string& name, const std::string& digest) const {
  const std::string path = folder_ + "/" + name;
  const File file(path, O_RDONLY);
  struct stat status {};
  if (file.fd() < 0 || fstat(file.fd(), &status) != 0) {
    const int why = errno;
    // A shared folder that is not mounted looks empty, or is not there at all.
    if (why == ENOENT && !empty()) throw DamagedLayers(path + ": is gone");
    throw Error(ErrorKind::kFailed,
                path + ": can't be read: " + std::strerror(why) + "; is the shared folder there?");
  }
  std::string bytes(static_cast<size_t>(status.st_size), '\0');
  size_t got = 0;
  while (got < bytes.size()) {
    const ssize_t n = read(file.fd(), bytes.data() + got, bytes.size() - got);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw Error(ErrorKind::kFailed, path + ": can't be read: " + std::strerror(errno));
    if (n == 0) break;
    got += static_cast<size_t>(n);
  }
  bytes.resize(got);
  if (sha256_hex(bytes) != digest) {
    throw DamagedLayers(path + ": corrupt: it is not what the database has the digest of");
  }
  return bytes;
}

void LayerFiles::remove(const std::string& name) const { unlink((folder_ + "/" + name).c_str()); }

void LayerFiles::keep_only(const std::set<std::string>& names) const {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error)) {
    const std::string name = entry.path().filename().string();
    if (!names.contains(name)) remove(name);
  }
}

bool LayerFiles::empty() const {
  std::error_code error;
  return fs::is_empty(folder_, error) || error;
}

void LayerFiles::probe(size_t bytes) const {
  constexpr const char* kName = "probe";
  put(kName, std::string(bytes, 'p'));
  remove(kName);
}

}  // namespace lightmill
