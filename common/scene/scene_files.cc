#include "common/scene/scene_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/base/utf8.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;

/// Closes the descriptor at the end of the scope.
struct Descriptor {
  int fd;
  ~Descriptor() {
    if (fd >= 0) close(fd);
  }
};

std::string too_large(size_t max_bytes) {
  return "is larger than the limit of " + std::to_string(max_bytes >> 20) + " MiB";
}

std::string inflate_all(const std::string& packed, size_t max_bytes) {
  constexpr int kGzipWindow = 15 + 16;
  z_stream stream{};
  if (inflateInit2(&stream, kGzipWindow) != Z_OK) fail_scene("can't start the gzip decoder");
  struct Guard {
    z_stream* s;
    ~Guard() { inflateEnd(s); }
  } guard{&stream};

  std::string out;
  size_t fed = 0;
  std::string chunk(size_t{1} << 20, '\0');
  for (;;) {
    if (stream.avail_in == 0 && fed < packed.size()) {
      const size_t count = std::min(packed.size() - fed, size_t{1} << 24);
      stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data() + fed));
      stream.avail_in = static_cast<uInt>(count);
      fed += count;
    }
    stream.next_out = reinterpret_cast<Bytef*>(chunk.data());
    stream.avail_out = static_cast<uInt>(chunk.size());
    const int status = inflate(&stream, Z_NO_FLUSH);
    const size_t produced = chunk.size() - stream.avail_out;
    if (out.size() + produced > max_bytes) fail_scene(too_large(max_bytes) + " when unpacked");
    out.append(chunk, 0, produced);
    if (status == Z_STREAM_END) {
      if (stream.avail_in == 0 && fed == packed.size()) return out;
      if (inflateReset(&stream) != Z_OK) fail_scene("is damaged gzip data");  // a further member
    } else if (status == Z_BUF_ERROR ||
               (status == Z_OK && produced == 0 && stream.avail_in == 0 && fed == packed.size())) {
      fail_scene("is truncated gzip data");
    } else if (status != Z_OK) {
      fail_scene("is damaged gzip data");
    }
  }
}

}  // namespace

std::string bundle_name(const std::string& reference) {
  const fs::path normal = fs::path(reference).lexically_normal();
  std::string text = normal.generic_string();
  if (is_safe_bundle_name(text) && !text.starts_with("external/")) return text;
  std::string base = normal.filename().string();
  base.erase(0, base.rfind('\\') + 1);  // npos + 1 is 0
  if (!is_safe_bundle_name(base)) base = "file";
  return "external/" + sha256_hex(text).substr(0, 16) + "/" + base;
}

bool is_safe_bundle_name(const std::string& name) {
  constexpr size_t kMaxLength = 1024;
  if (name.empty() || name.size() > kMaxLength || !is_utf8(name)) return false;
  for (char c : name) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f || c == '\\') return false;
  }
  for (size_t begin = 0; begin <= name.size();) {
    const size_t end = std::min(name.find('/', begin), name.size());
    const std::string part = name.substr(begin, end - begin);
    if (part.empty() || part == "." || part == "..") return false;
    begin = end + 1;
  }
  return true;
}

std::string why_unreadable(const std::string& path) {
  struct stat info {};
  if (stat(path.c_str(), &info) != 0) return std::strerror(errno);
  if (!S_ISREG(info.st_mode)) return "it is not a regular file";
  if (access(path.c_str(), R_OK) != 0) return std::strerror(errno);
  constexpr off_t kLongestPointer = 1023;  // by the specification of Git LFS
  if (info.st_size > kLongestPointer) return "";
  constexpr std::string_view kPointer = "version https://git-lfs.github.com/spec/";
  std::string start(kPointer.size(), '\0');
  std::ifstream(path, std::ios::binary).read(start.data(), static_cast<std::streamsize>(start.size()));
  return start == kPointer ? "it is a pointer of Git LFS; `git lfs pull` fetches the file itself" : "";
}

std::string read_scene_file(const std::string& path, size_t max_bytes) {
  // O_NONBLOCK: opening a named pipe must not hang.
  const Descriptor file{open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  struct stat info {};
  if (file.fd < 0 || fstat(file.fd, &info) != 0)
    fail_scene(std::string("can't be read: ") + std::strerror(errno));
  if (!S_ISREG(info.st_mode)) fail_scene("is not a regular file");
  const auto size = static_cast<size_t>(info.st_size);
  if (size > max_bytes) fail_scene(too_large(max_bytes));
  std::string contents(size, '\0');
  size_t have = 0;
  while (have < size) {
    const ssize_t got = read(file.fd, contents.data() + have, size - have);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail_scene(std::string("can't be read: ") + std::strerror(errno));
    if (got == 0) break;  // it shrank meanwhile
    have += static_cast<size_t>(got);
  }
  contents.resize(have);
  return contents.starts_with("\x1f\x8b") ? inflate_all(contents, max_bytes) : contents;
}

}  // namespace lightmill
