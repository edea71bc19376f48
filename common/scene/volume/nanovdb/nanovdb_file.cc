#include "common/scene/volume/nanovdb/nanovdb_file.h"

#include <blosc.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>

#include "common/base/error.h"

namespace lightmill {
namespace {

// "NanoVDB0", "NanoVDB1" (a grid) and "NanoVDB2" (a file, from 32.6 on); the last character comes highest.
constexpr uint64_t kMagic = 0x004244566f6e614e, kMagicMask = 0x00ffffffffffffff;
constexpr uint32_t kMajorVersion = 32;
constexpr uint16_t kZip = 1, kBlosc = 2;
constexpr uint64_t kHeader = 16, kMetaData = 176, kMostGrids = 4096, kLongestName = 4096;
constexpr uint64_t kBloscChunk = uint64_t{1} << 30;
constexpr uint64_t kLargestGrid = uint64_t{1} << 34;
/// No packed byte becomes more than this many.
constexpr uint64_t kMostExpansion = 1100;
constexpr uint32_t kLevelSet = 1;

class File {
 public:
  explicit File(const std::string& path) : in_(path, std::ios::binary) {
    in_.seekg(0, std::ios::end);
    size_ = in_ ? static_cast<uint64_t>(in_.tellg()) : 0;
  }
  uint64_t size() const { return size_; }
  void read(uint64_t offset, void* to, uint64_t count) {
    if (offset > size_ || size_ - offset < count) throw Error(ErrorKind::kBadScene, "is cut short");
    in_.clear();
    in_.seekg(static_cast<std::streamoff>(offset));
    in_.read(static_cast<char*>(to), static_cast<std::streamsize>(count));
    if (!in_) throw Error(ErrorKind::kBadScene, "can't be read");
  }
  /// In parts: what is in a file of the system's is not to be in memory as a whole.
  void append_to(SpillArray<char>* to, uint64_t offset, uint64_t count) {
    std::vector<char> part(std::min<uint64_t>(count, uint64_t{1} << 20));
    while (count > 0) {
      const uint64_t some = std::min<uint64_t>(count, part.size());
      read(offset, part.data(), some);
      to->append(part.data(), some);
      offset += some, count -= some;
    }
  }
  template <class T>
  T at(uint64_t offset) {
    T value;
    read(offset, &value, sizeof value);
    return value;
  }

 private:
  std::ifstream in_;
  uint64_t size_ = 0;
};

VolumeValueKind kind_of(uint32_t type) {
  constexpr uint32_t kFloatType = 1, kFp4Type = 13, kFp8Type = 14, kFp16Type = 15, kFpNType = 16;
  switch (type) {
    case kFloatType:
      return VolumeValueKind::kFloat;
    case kFp4Type:
      return VolumeValueKind::kFp4;
    case kFp8Type:
      return VolumeValueKind::kFp8;
    case kFp16Type:
      return VolumeValueKind::kFp16;
    case kFpNType:
      return VolumeValueKind::kFpN;
    default:
      return VolumeValueKind::kOther;
  }
}

}  // namespace

std::vector<NanoVdbEntry> nanovdb_entries(const std::string& path) {
  File file(path);
  std::vector<NanoVdbEntry> entries;
  for (uint64_t segment = 0; segment == 0 || segment < file.size();) {
    if (file.size() < kHeader || (file.at<uint64_t>(segment) & kMagicMask) != kMagic)
      throw Error(ErrorKind::kBadScene,
                  segment == 0 ? "is not a NanoVDB file" : "is damaged after its first grids");
    const uint32_t major = file.at<uint32_t>(segment + 8) >> 21;
    if (major != kMajorVersion) {
      throw Error(ErrorKind::kBadScene, "is of NanoVDB's version " + std::to_string(major) +
                                            "; convert it with a program of version 32");
    }
    const auto count = file.at<uint16_t>(segment + 12);
    if (entries.size() + count > kMostGrids) throw Error(ErrorKind::kBadScene, "has more than 4096 grids");
    const size_t first = entries.size();
    uint64_t at = segment + kHeader;
    for (uint16_t i = 0; i < count; ++i) {
      NanoVdbEntry e;
      e.grid_size = file.at<uint64_t>(at);
      e.file_size = file.at<uint64_t>(at + 8);
      e.kind = kind_of(file.at<uint32_t>(at + 32));
      e.is_level_set = file.at<uint32_t>(at + 36) == kLevelSet;
      const auto name_size = file.at<uint32_t>(at + 136);
      e.codec = file.at<uint16_t>(at + 168);
      if (name_size > kLongestName)
        throw Error(ErrorKind::kBadScene, "is damaged: a grid's name is too long");
      std::vector<char> name(name_size);
      file.read(at + kMetaData, name.data(), name_size);
      e.name.assign(name.data(), strnlen(name.data(), name.size()));
      at += kMetaData + name_size;
      entries.push_back(e);
    }
    for (size_t i = first; i < entries.size(); ++i) {
      entries[i].offset = at;
      if (entries[i].file_size > file.size() - at) throw Error(ErrorKind::kBadScene, "is cut short");
      at += entries[i].file_size;
    }
    if (at <= segment) break;
    segment = at;
  }
  return entries;
}

SpillArray<char> nanovdb_bytes(const std::string& path, const NanoVdbEntry& e,
                               const std::shared_ptr<SpillArea>& area) {
  const bool packed = e.codec == kZip || e.codec == kBlosc;
  if (!packed && e.codec != 0) throw Error(ErrorKind::kBadScene, "is packed in a way that is not known");
  if (e.grid_size > kLargestGrid) throw Error(ErrorKind::kBadScene, "is larger than 16 GiB");
  if (e.grid_size > e.file_size * (packed ? kMostExpansion : 1))
    throw Error(ErrorKind::kBadScene, "is damaged: it has fewer bytes than it says");
  File file(path);
  SpillArray<char> out(area);
  if (!packed) {
    file.append_to(&out, e.offset, e.grid_size);
    return out;
  }
  out.resize(e.grid_size);
  uint64_t at = e.offset;
  const uint64_t end = e.offset + e.file_size;
  const Error bad(ErrorKind::kBadScene, "is damaged: it can't be unpacked");
  for (uint64_t done = 0; done < out.size();) {
    const uint64_t want = e.codec == kZip ? out.size() : std::min(kBloscChunk, out.size() - done);
    const auto size = file.at<uint64_t>(at);
    if (size > end - at || size < 1) throw bad;
    SpillArray<char> in(area);
    file.append_to(&in, at + 8, size);
    at += 8 + size;
    if (e.codec == kZip) {
      uLongf written = want;
      if (uncompress(reinterpret_cast<Bytef*>(out.data()), &written,
                     reinterpret_cast<const Bytef*>(in.data()), size) != Z_OK ||
          written != want)
        throw bad;
    } else {
      size_t unpacked = 0;
      if (blosc_cbuffer_validate(in.data(), in.size(), &unpacked) != 0 || unpacked != want ||
          blosc_decompress_ctx(in.data(), out.data() + done, want, 1) != static_cast<int>(want))
        throw bad;
    }
    done += want;
  }
  return out;
}

}  // namespace lightmill
