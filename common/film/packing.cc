#include "common/film/packing.h"

#include <zstd.h>

#include <new>
#include <stdexcept>

#include "common/base/digest.h"
#include "common/base/error.h"

namespace lightmill {

namespace {

constexpr int kSnapshotLevel = 1;
constexpr size_t kDigestAt = 2 * sizeof(uint32_t), kDigestBytes = 64;  // in what is sealed

[[noreturn]] void corrupt(const char* what, const std::string& reason) {
  throw Error(ErrorKind::kFailed, std::string(what) + " is corrupt: " + reason);
}

}  // namespace

void ByteWriter::put_varint(uint64_t value) {
  while (value >= 0x80) {
    bytes_.push_back(static_cast<char>(value | 0x80));
    value >>= 7;
  }
  bytes_.push_back(static_cast<char>(value));
}

uint64_t ByteReader::get_varint() {
  uint64_t value = 0;
  for (int shift = 0; shift < 64; shift += 7) {
    const auto byte = get<uint8_t>();
    const uint64_t bits = byte & 0x7fu;
    if (shift == 63 && bits > 1) break;
    value |= bits << shift;
    if (byte < 0x80) {
      // A padded form would be a second spelling of the same content.
      if (byte == 0 && shift > 0) fail("overlong number");
      return value;
    }
  }
  fail("number over 64 bits");
}

std::string_view ByteReader::get_bytes(size_t count) {
  if (count > rest_.size()) fail("truncated");
  const std::string_view bytes = rest_.substr(0, count);
  rest_.remove_prefix(count);
  return bytes;
}

void ByteReader::expect_end() const {
  if (!rest_.empty()) fail(std::to_string(rest_.size()) + " bytes too many");
}

void ByteReader::fail(const std::string& reason) const { corrupt(what_, reason); }

std::string zstd_pack(std::string_view raw, int level) {
  std::string packed(ZSTD_compressBound(raw.size()), '\0');
  const size_t size = ZSTD_compress(packed.data(), packed.size(), raw.data(), raw.size(), level);
  if (ZSTD_isError(size)) throw std::logic_error(std::string("zstd: ") + ZSTD_getErrorName(size));
  packed.resize(size);
  return packed;
}

namespace {

/// Exactly one frame that says that it holds so many bytes.
void check_frame(std::string_view packed, size_t raw_size, const char* what) {
  const unsigned long long declared = ZSTD_getFrameContentSize(packed.data(), packed.size());
  if (declared == ZSTD_CONTENTSIZE_ERROR) corrupt(what, "no zstd frame");
  if (declared != raw_size) corrupt(what, "unexpected decompressed size");
  if (ZSTD_findFrameCompressedSize(packed.data(), packed.size()) != packed.size()) {
    corrupt(what, "truncated or followed by other data");
  }
}

void unpack_frame(std::string_view packed, std::span<char> raw, const char* what) {
  // Kept by the thread: making one takes longer than unpacking a small partial.
  thread_local std::unique_ptr<ZSTD_DCtx, size_t (*)(ZSTD_DCtx*)> context{nullptr, ZSTD_freeDCtx};
  if (!context) context.reset(ZSTD_createDCtx());
  if (!context) throw std::bad_alloc();
  const size_t size =
      ZSTD_decompressDCtx(context.get(), raw.data(), raw.size(), packed.data(), packed.size());
  if (ZSTD_isError(size)) corrupt(what, ZSTD_getErrorName(size));
  if (size != raw.size()) corrupt(what, "unexpected decompressed size");
}

}  // namespace

void zstd_unpack(std::string_view packed, std::span<char> raw, const char* what) {
  check_frame(packed, raw.size(), what);
  unpack_frame(packed, raw, what);
}

std::string zstd_unpack(std::string_view packed, size_t raw_size, const char* what) {
  check_frame(packed, raw_size, what);  // before anything of that size is allocated
  std::string raw(raw_size, '\0');
  unpack_frame(packed, raw, what);
  return raw;
}

struct ZstdStream::Impl {
  std::string* out = nullptr;
  std::unique_ptr<ZSTD_CCtx, size_t (*)(ZSTD_CCtx*)> context{ZSTD_createCCtx(), ZSTD_freeCCtx};
  std::string buffer = std::string(ZSTD_CStreamOutSize(), '\0');

  /// What the thread's last stream left.
  static std::unique_ptr<Impl>& spare() {
    thread_local std::unique_ptr<Impl> spare;
    return spare;
  }
};

ZstdStream::ZstdStream(size_t raw_size, int level, std::string* out) : impl_(std::move(Impl::spare())) {
  if (!impl_) impl_ = std::make_unique<Impl>();
  impl_->out = out;
  ZSTD_CCtx* context = impl_->context.get();
  if (!context) throw std::bad_alloc();
  ZSTD_CCtx_reset(context, ZSTD_reset_session_and_parameters);
  ZSTD_CCtx_setParameter(context, ZSTD_c_compressionLevel, level);
  ZSTD_CCtx_setPledgedSrcSize(context, raw_size);
  // What is reserved and not written takes no memory; growing would copy.
  out->reserve(out->size() + ZSTD_compressBound(raw_size));
}

ZstdStream::~ZstdStream() {
  if (impl_->context) Impl::spare() = std::move(impl_);
}

void ZstdStream::run(std::string_view piece, bool last) {
  ZSTD_inBuffer in{piece.data(), piece.size(), 0};
  for (bool done = false; !done;) {
    ZSTD_outBuffer out{impl_->buffer.data(), impl_->buffer.size(), 0};
    const size_t left =
        ZSTD_compressStream2(impl_->context.get(), &out, &in, last ? ZSTD_e_end : ZSTD_e_continue);
    if (ZSTD_isError(left)) throw std::logic_error(std::string("zstd: ") + ZSTD_getErrorName(left));
    impl_->out->append(impl_->buffer.data(), out.pos);
    done = last ? left == 0 : in.pos == in.size;
  }
}

void ZstdStream::write(std::string_view piece) { run(piece, false); }
void ZstdStream::end() { run({}, true); }

Sealer::Sealer(uint32_t magic, uint32_t version, size_t raw_size) {
  ByteWriter head;
  head.put(magic);
  head.put(version);
  head.put_bytes(std::string(kDigestBytes, '0'));
  head.put<uint64_t>(raw_size);
  sealed_ = std::move(head.bytes());
  stream_ = std::make_unique<ZstdStream>(raw_size, kSnapshotLevel, &sealed_);
}

std::string Sealer::finish() {
  stream_->end();
  sealed_.replace(kDigestAt, kDigestBytes,
                  sha256_hex(std::string_view(sealed_).substr(kDigestAt + kDigestBytes)));
  return std::move(sealed_);
}

std::string seal(uint32_t magic, uint32_t version, std::string_view raw) {
  Sealer sealer(magic, version, raw.size());
  sealer.write(raw);
  return sealer.finish();
}

uint32_t sealed_version(uint32_t magic, std::string_view sealed, const char* what) {
  ByteReader in(sealed, what);
  if (in.get<uint32_t>() != magic) in.fail("wrong magic word");
  return in.get<uint32_t>();
}

std::string unseal(uint32_t magic, uint32_t version, std::string_view sealed, const char* what) {
  ByteReader in(sealed, what);
  if (in.get<uint32_t>() != magic) in.fail("wrong magic word");
  const auto found = in.get<uint32_t>();
  if (found != version) {
    in.fail("version " + std::to_string(found) + ", this program reads " + std::to_string(version));
  }
  const std::string_view digest = in.get_bytes(64);
  if (sha256_hex(in.rest()) != digest) in.fail("wrong digest");
  const auto raw_size = in.get<uint64_t>();
  return zstd_unpack(in.rest(), raw_size, what);
}

}  // namespace lightmill
