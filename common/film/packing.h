#pragma once
// Packing numbers and byte strings: little-endian fields, zstd, and sealed snapshots.
//
//   ByteWriter w;  w.put<uint32_t>(7);  w.put(3.5);
//   ByteReader r(w.bytes(), "film snapshot");  r.get<uint32_t>();  r.get<double>();  r.expect_end();
#include <bit>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace lightmill {

static_assert(std::endian::native == std::endian::little, "the packed formats are little-endian");

/// Appends little-endian fields to a byte string.
class ByteWriter {
 public:
  template <typename T>
  void put(T value) {
    static_assert(std::is_arithmetic_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  /// Unsigned LEB128: 7 bits a byte, lowest first.
  void put_varint(uint64_t value);
  void put_bytes(std::string_view bytes) { bytes_.append(bytes); }
  std::string& bytes() { return bytes_; }

 private:
  std::string bytes_;
};

/// Reads what ByteWriter wrote. Every read past the end throws Error(kFailed) that names `what`.
class ByteReader {
 public:
  ByteReader(std::string_view bytes, const char* what) : rest_(bytes), what_(what) {}
  template <typename T>
  T get() {
    static_assert(std::is_arithmetic_v<T>);
    T value;
    std::memcpy(&value, get_bytes(sizeof value).data(), sizeof value);
    return value;
  }
  uint64_t get_varint();
  std::string_view get_bytes(size_t count);
  std::string_view rest() const { return rest_; }
  /// Throws unless everything was read.
  void expect_end() const;
  /// Throws Error(kFailed, "WHAT is corrupt: REASON").
  [[noreturn]] void fail(const std::string& reason) const;

 private:
  std::string_view rest_;
  const char* what_;
};

/// One zstd frame that records its content size.
std::string zstd_pack(std::string_view raw, int level);
/// Inverse: exactly one frame of exactly `raw_size` bytes. The caller knows that number, and it bounds the
/// allocation. Throws Error(kFailed) that names `what`.
std::string zstd_unpack(std::string_view packed, size_t raw_size, const char* what);
/// The same, for as many bytes as `raw` has room for.
void zstd_unpack(std::string_view packed, std::span<char> raw, const char* what);

/// Makes the same frame of `raw_size` bytes that come piece by piece, so that they need not be in memory all
/// at once.
class ZstdStream {
 public:
  /// Appends to `out`, which must outlive the stream.
  ZstdStream(size_t raw_size, int level, std::string* out);
  ~ZstdStream();
  ZstdStream(const ZstdStream&) = delete;
  ZstdStream& operator=(const ZstdStream&) = delete;
  void write(std::string_view piece);
  /// Call once all is written. Throws std::logic_error if that was not raw_size bytes.
  void end();

 private:
  struct Impl;
  void run(std::string_view piece, bool last);
  std::unique_ptr<Impl> impl_;
};

/// seal() of bytes that come piece by piece.
class Sealer {
 public:
  Sealer(uint32_t magic, uint32_t version, size_t raw_size);
  void write(std::string_view piece) { stream_->write(piece); }
  /// Call once all is written.
  std::string finish();

 private:
  std::string sealed_;
  std::unique_ptr<ZstdStream> stream_;
};

/// Compresses `raw` under a magic word, a version and a SHA-256 of all that follows.
std::string seal(uint32_t magic, uint32_t version, std::string_view raw);
/// The version that it stands under; not checked. Throws Error(kFailed) that names `what`.
uint32_t sealed_version(uint32_t magic, std::string_view sealed, const char* what);
/// Inverse. The digest is checked before anything is decompressed. Throws Error(kFailed) that names `what`.
std::string unseal(uint32_t magic, uint32_t version, std::string_view sealed, const char* what);

}  // namespace lightmill
