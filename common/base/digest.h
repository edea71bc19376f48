#pragma once
// SHA-256 digests, written as 64 lower-case hex digits. They name blobs, bundles and partials.
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

namespace lightmill {

/// Incremental SHA-256: `Sha256 h; h.update(a); h.update(b); h.hex()`.
class Sha256 {
 public:
  Sha256();
  ~Sha256();
  Sha256(const Sha256&) = delete;
  Sha256& operator=(const Sha256&) = delete;
  void update(const void* data, size_t bytes);
  void update(std::string_view data) { update(data.data(), data.size()); }
  /// Ends the digest; call once.
  std::string hex();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Digest of a byte string.
std::string sha256_hex(std::string_view data);
/// Digest of a file's contents; throws Error(kFailed) if it can't be read.
std::string sha256_file(const std::string& path);
/// True for exactly 64 lower-case hex digits: what may be used as a blob's name on disk.
bool is_sha256_hex(std::string_view s);

}  // namespace lightmill
