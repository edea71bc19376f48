#include "common/image/qoi_file.h"

#include <array>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <type_traits>

#include "common/base/lower_case.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;

constexpr size_t kHeaderBytes = 14;
constexpr uint64_t kMaxFileBytes = uint64_t{1} << 32;
constexpr uint64_t kLongestRun = 62;  // pixels that one byte can stand for
constexpr int kMostPixelsASide = 1 << 30;

uint32_t big_endian(const unsigned char* from) {
  return uint32_t{from[0]} << 24 | uint32_t{from[1]} << 16 | uint32_t{from[2]} << 8 | uint32_t{from[3]};
}

struct Pixel {
  uint8_t channel[4] = {0, 0, 0, 255};

  /// Where pixels that were seen are kept.
  size_t slot() const {
    return (channel[0] * 3u + channel[1] * 5u + channel[2] * 7u + channel[3] * 11u) % 64;
  }
  void add(int r, int g, int b) {
    channel[0] = static_cast<uint8_t>(channel[0] + r);
    channel[1] = static_cast<uint8_t>(channel[1] + g);
    channel[2] = static_cast<uint8_t>(channel[2] + b);
  }
};

/// Takes the pixels of a file one by one.
class Unpacker {
 public:
  Unpacker(const unsigned char* bytes, size_t size) : at_(bytes), end_(bytes + size) {}

  /// False: the file has no more.
  bool next(Pixel* pixel) {
    if (run_ > 0) {
      --run_;
      *pixel = last_;
      return true;
    }
    if (at_ == end_) return false;
    const unsigned char first = *at_++;
    const int low = first & 0x3f;
    switch (first >> 6) {
      case 0:
        last_ = seen_[static_cast<size_t>(low)];
        break;
      case 1:  // differences of two bits
        last_.add((low >> 4) - 2, (low >> 2 & 3) - 2, (low & 3) - 2);
        break;
      case 2: {  // of green, and of the others to it
        if (at_ == end_) return false;
        const int second = *at_++, green = low - 32;
        last_.add(green + (second >> 4) - 8, green, green + (second & 0xf) - 8);
        break;
      }
      default:
        if (low < static_cast<int>(kLongestRun)) {
          run_ = low;
        } else {
          const int channels = low == 0x3e ? 3 : 4;
          if (end_ - at_ < channels) return false;
          for (int c = 0; c < channels; ++c) last_.channel[c] = *at_++;
        }
    }
    seen_[last_.slot()] = last_;
    *pixel = last_;
    return true;
  }

 private:
  const unsigned char *at_, *end_;
  Pixel last_;
  std::array<Pixel, 64> seen_ = all_zero();
  int run_ = 0;

  static std::array<Pixel, 64> all_zero() {
    std::array<Pixel, 64> pixels;
    for (Pixel& p : pixels) p.channel[3] = 0;
    return pixels;
  }
};

}  // namespace

bool is_qoi(const std::string& path) { return lower_case(fs::path(path).extension().string()) == ".qoi"; }

std::optional<QoiFile> QoiFile::open(const ImageSource& source, std::string* why) {
  QoiFile file;
  if (source.contents) {
    file.bytes_ = static_cast<const unsigned char*>(source.contents);
    file.size_ = source.bytes;
  } else {
    std::error_code ec;
    const uint64_t size = fs::file_size(source.path, ec);
    std::ifstream in(source.path, std::ios::binary);
    if (ec || !in) {
      *why = ec ? ec.message() : std::error_code(errno, std::generic_category()).message();
      return std::nullopt;
    }
    if (size > kMaxFileBytes) {
      *why = "it is larger than " + std::to_string(kMaxFileBytes) + " bytes";
      return std::nullopt;
    }
    std::string contents(size, '\0');
    in.read(contents.data(), static_cast<std::streamsize>(size));
    contents.resize(static_cast<size_t>(in.gcount()));
    file.file_ = std::make_unique<const std::string>(std::move(contents));
    file.bytes_ = reinterpret_cast<const unsigned char*>(file.file_->data());
    file.size_ = file.file_->size();
  }
  const unsigned char* head = file.bytes_;
  if (file.size_ < kHeaderBytes || head[0] != 'q' || head[1] != 'o' || head[2] != 'i' || head[3] != 'f') {
    *why = "it is no QOI file";
    return std::nullopt;
  }
  const uint32_t width = big_endian(head + 4), height = big_endian(head + 8);
  const int channels = head[12];
  if (width < 1 || height < 1 || width > kMostPixelsASide || height > kMostPixelsASide ||
      (channels != 3 && channels != 4)) {
    *why = "its header is damaged";
    return std::nullopt;
  }
  if (uint64_t{width} * height > kLongestRun * (file.size_ - kHeaderBytes)) {
    *why = "it is cut off: it can't hold the " + std::to_string(width) + " x " + std::to_string(height) +
           " pixels of its header";
    return std::nullopt;
  }
  file.header_ = {static_cast<int>(width), static_cast<int>(height), 1, channels, true, false, head[13] == 1};
  return file;
}

template <class Value>
bool QoiFile::unpack(int begin, int end, Value* out, std::string* why) const {
  Unpacker pixels(bytes_ + kHeaderBytes, size_ - kHeaderBytes);
  const uint64_t count = static_cast<uint64_t>(header_.width) * static_cast<uint64_t>(header_.height);
  Pixel pixel;
  for (uint64_t i = 0; i < count; ++i) {
    if (!pixels.next(&pixel)) {
      *why = "it is cut off: it has " + std::to_string(i) + " of its " + std::to_string(count) + " pixels";
      return false;
    }
    for (int c = begin; c < end; ++c) {
      if constexpr (std::is_floating_point_v<Value>) {
        *out++ = static_cast<Value>(pixel.channel[c]) / 255;
      } else {
        *out++ = pixel.channel[c];
      }
    }
  }
  return true;
}

bool QoiFile::read(int begin, int end, uint8_t* out, std::string* why) const {
  return unpack(begin, end, out, why);
}
bool QoiFile::read(int begin, int end, float* out, std::string* why) const {
  return unpack(begin, end, out, why);
}

}  // namespace lightmill
