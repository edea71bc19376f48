#include "common/scene/volume/openvdb/openvdb_file.h"

#include <blosc.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "common/base/error.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

constexpr uint64_t kMagic = 0x56444220;
/// From 222 on inactive values are left out (OpenVDB 2.0, 2013); 224 is the newest.
constexpr uint32_t kOldest = 222, kNewest = 239;
constexpr uint64_t kUuid = 36;
constexpr uint32_t kZip = 1, kActiveMask = 2, kBlosc = 4;
constexpr uint32_t kMostGrids = 4096, kMostFacts = 65536, kLongestText = 1 << 20;

const Error kCutShort(ErrorKind::kBadScene, "is cut short");
Error damaged(const std::string& what) { return Error(ErrorKind::kBadScene, "is damaged: " + what); }

/// Without the number that tells grids of one name apart.
std::string name_of(const std::string& full_name) { return full_name.substr(0, full_name.find('\x1e')); }

/// Names, types and values of what is known of a file or grid. Returns the value of `wanted`, a text.
std::string read_facts(OpenVdbStream* in, const std::string& wanted) {
  const auto count = in->number<uint32_t>();
  if (count > kMostFacts) throw damaged("it says too much of itself");
  std::string found;
  for (uint32_t i = 0; i < count; ++i) {
    const std::string name = in->text(), type = in->text();
    auto size = in->number<uint32_t>();
    if (name == wanted && type == "string" && size < kLongestText) {
      found.resize(size);
      in->read(found.data(), size);
      continue;
    }
    for (char skipped[4096]; size > 0;) {
      const uint32_t some = std::min<uint32_t>(size, sizeof skipped);
      in->read(skipped, some);
      size -= some;
    }
  }
  return found;
}

float float_of_half(uint16_t h) {
  const int exponent = h >> 10 & 31, fraction = h & 1023;
  const float size = exponent == 31  ? fraction == 0 ? HUGE_VALF : NAN
                     : exponent == 0 ? std::ldexp(static_cast<float>(fraction), -24)
                                     : std::ldexp(static_cast<float>(fraction + 1024), exponent - 25);
  return h >> 15 ? -size : size;
}

void set_type(std::string type, OpenVdbEntry* e) {
  constexpr std::string_view kHalf = "_HalfFloat";
  e->half = type.ends_with(kHalf);
  if (e->half) type.resize(type.size() - kHalf.size());
  if (type == "Tree_float_5_4_3") e->value = OpenVdbValue::kFloat;
  if (type == "Tree_double_5_4_3") e->value = OpenVdbValue::kDouble;
}

}  // namespace

OpenVdbStream::OpenVdbStream(const std::string& path, uint64_t begin, uint64_t end)
    : in_(path, std::ios::binary) {
  in_.seekg(0, std::ios::end);
  file_size_ = in_ ? std::min(static_cast<uint64_t>(in_.tellg()), end) : 0;
  seek(begin);
}

void OpenVdbStream::seek(uint64_t offset) {
  if (offset > file_size_) throw kCutShort;
  left_ = file_size_ - offset;
  in_.clear();
  in_.seekg(static_cast<std::streamoff>(offset));
}

void OpenVdbStream::read(void* to, uint64_t count) {
  if (count > left_) throw kCutShort;
  in_.read(static_cast<char*>(to), static_cast<std::streamsize>(count));
  if (!in_) throw Error(ErrorKind::kBadScene, "can't be read");
  left_ -= count;
}

std::string OpenVdbStream::text() {
  const auto size = number<uint32_t>();
  if (size > kLongestText) throw damaged("a name is too long");
  std::string text(size, '\0');
  read(text.data(), size);
  return text;
}

OpenVdbHead OpenVdbStream::read_head() {
  packing_ = number<uint32_t>();
  if (packing_ & ~(kZip | kActiveMask | kBlosc))
    throw Error(ErrorKind::kBadScene, "is packed in a way that is not known");
  const bool is_level_set = read_facts(this, "class") == "level set";
  return {is_level_set, read_map()};
}

std::optional<Transform> OpenVdbStream::read_map() {
  const std::string type = text();
  double x[18];
  Transform t;
  const auto set_diagonal = [&](const double* scale) {
    for (size_t i = 0; i < 3; ++i) t.m[i][i] = scale[i];
  };
  const auto set_translation = [&](const double* by) {
    for (size_t i = 0; i < 3; ++i) t.m[i][3] = by[i];
  };
  if (type == "AffineMap" || type == "UnitaryMap") {
    read(x, 16 * sizeof(double));
    // Points are rows there: p M.
    for (size_t row = 0; row < 3; ++row) {
      for (size_t column = 0; column < 4; ++column) t.m[row][column] = x[4 * column + row];
    }
  } else if (type == "ScaleMap" || type == "UniformScaleMap") {
    read(x, 15 * sizeof(double));  // and what follows from the scale
    set_diagonal(x);
  } else if (type == "TranslationMap") {
    read(x, 3 * sizeof(double));
    set_translation(x);
  } else if (type == "ScaleTranslateMap" || type == "UniformScaleTranslateMap") {
    read(x, 18 * sizeof(double));
    set_translation(x);
    set_diagonal(x + 3);
  } else {
    return {};
  }
  return t;
}

void OpenVdbStream::unpacked(std::vector<char>* out) {
  if (!(packing_ & (kZip | kBlosc))) return read(out->data(), out->size());
  const Error bad = damaged("it can't be unpacked");
  const auto size = number<int64_t>();
  if (size <= 0) {
    if (size != -static_cast<int64_t>(out->size())) throw bad;
    return read(out->data(), out->size());
  }
  if (static_cast<uint64_t>(size) > left_) throw kCutShort;
  std::vector<char> in(static_cast<size_t>(size));
  read(in.data(), in.size());
  if (packing_ & kBlosc) {
    size_t unpacked = 0;
    if (blosc_cbuffer_validate(in.data(), in.size(), &unpacked) != 0 || unpacked != out->size() ||
        blosc_decompress_ctx(in.data(), out->data(), out->size(), 1) != static_cast<int>(out->size()))
      throw bad;
    return;
  }
  uLongf written = out->size();
  if (uncompress(reinterpret_cast<Bytef*>(out->data()), &written, reinterpret_cast<const Bytef*>(in.data()),
                 in.size()) != Z_OK ||
      written != out->size())
    throw bad;
}

double OpenVdbStream::value(const OpenVdbEntry& e) {
  return e.value == OpenVdbValue::kDouble ? number<double>() : double{number<float>()};
}

void OpenVdbStream::values(const OpenVdbEntry& e, double background, const std::vector<uint64_t>& active,
                           std::vector<double>* out) {
  // What is stored of the values that are off.
  enum : uint8_t { kBackground, kMinusBackground, kOne, kBothBackgrounds, kBackgroundOrOne, kTwo, kAll };
  const auto kind = number<uint8_t>();
  if (kind > kAll) throw damaged("values are stored in a way that is not known");
  double off[2] = {kind == kBackground ? background : -background, background};
  if (kind == kOne || kind == kBackgroundOrOne || kind == kTwo) off[0] = value(e);
  if (kind == kTwo) off[1] = value(e);
  std::vector<uint64_t> second(active.size(), 0);
  if (kind == kBothBackgrounds || kind == kBackgroundOrOne || kind == kTwo)
    read(second.data(), second.size() * sizeof(uint64_t));
  const bool only_active = packing_ & kActiveMask && kind != kAll;
  size_t count = out->size();
  if (only_active) {
    count = 0;
    for (const uint64_t word : active) count += static_cast<size_t>(std::popcount(word));
  }
  const size_t size = e.half ? 2 : e.value == OpenVdbValue::kDouble ? 8 : 4;
  std::vector<char> stored(count * size);
  if (count > 0 || !e.half) unpacked(&stored);
  size_t next = 0;
  for (size_t i = 0; i < out->size(); ++i) {
    const auto is_on = [&](const std::vector<uint64_t>& mask) { return (mask[i / 64] >> (i % 64) & 1) != 0; };
    if (only_active && !is_on(active)) {
      (*out)[i] = off[is_on(second)];
      continue;
    }
    const char* const from = stored.data() + size * next++;
    const auto as = [&](auto type) {
      std::memcpy(&type, from, sizeof type);
      return type;
    };
    (*out)[i] = e.half                             ? double{float_of_half(as(uint16_t{}))}
                : e.value == OpenVdbValue::kDouble ? as(0.0)
                                                   : double{as(0.0f)};
  }
}

bool is_openvdb(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  uint64_t magic = 0;
  in.read(reinterpret_cast<char*>(&magic), sizeof magic);
  return in && magic == kMagic;
}

std::vector<OpenVdbEntry> openvdb_entries(const std::string& path) {
  OpenVdbStream in(path, 0, UINT64_MAX);
  if (in.number<uint64_t>() != kMagic) throw Error(ErrorKind::kBadScene, "is not an OpenVDB file");
  const auto version = in.number<uint32_t>();
  if (version < kOldest || version > kNewest) {
    throw Error(ErrorKind::kBadScene, "is of OpenVDB's file version " + std::to_string(version) +
                                          ", of which " + std::to_string(kOldest) +
                                          " and later are read; write it "
                                          "anew with a newer program");
  }
  in.number<uint64_t>();  // version of the library
  if (in.number<uint8_t>() == 0)
    throw Error(ErrorKind::kBadScene,
                "was written as a stream, without places of its grids; write it as a file");
  char uuid[kUuid];
  in.read(uuid, sizeof uuid);
  read_facts(&in, "");
  const auto count = in.number<int32_t>();
  if (count < 0 || static_cast<uint32_t>(count) > kMostGrids)
    throw Error(ErrorKind::kBadScene, "has more than 4096 grids");
  std::vector<OpenVdbEntry> entries(static_cast<size_t>(count));
  for (OpenVdbEntry& e : entries) {
    e.full_name = in.text();
    e.name = name_of(e.full_name);
    set_type(in.text(), &e);
    e.parent = in.text();
    e.grid = in.number<uint64_t>();
    e.blocks = in.number<uint64_t>();
    e.end = in.number<uint64_t>();
    in.seek(e.grid);
    const OpenVdbHead head = in.read_head();
    e.is_level_set = head.is_level_set;
    e.is_affine = head.index_to_world.has_value();
    in.seek(e.end);
  }
  return entries;
}

}  // namespace lightmill
