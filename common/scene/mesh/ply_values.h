#pragma once
// The values of a PLY file's body, one after another: from binary data of either byte order, and from text.
// Both have the same interface, so that the reader is written once.
#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <string_view>

#include "common/base/error.h"
#include "common/base/parse_number.h"
#include "common/scene/mesh/ply_header.h"
#include "common/scene/problem_list.h"

namespace lightmill {

/// Reads values one after another out of binary data; never past the end.
class BinaryValues {
 public:
  BinaryValues(std::string_view data, bool big_endian) : data_(data), swap_(big_endian) {}

  bool has(size_t bytes) const { return bytes <= data_.size() - at_; }
  void skip(size_t bytes) { at_ += bytes; }
  /// Fewest bytes that a value of this type takes, so that counts can be checked before allocating.
  static size_t least_bytes(PlyType type) { return ply_type_size(type); }
  size_t remaining() const { return data_.size() - at_; }

  /// False at the end of the data.
  bool next(PlyType type, double* value) {
    const size_t size = ply_type_size(type);
    if (!has(size)) return false;
    *value = get(type, data_.data() + at_);
    at_ += size;
    return true;
  }
  /// The value at an offset from here, which the caller knows to be inside.
  double peek(PlyType type, size_t offset) const { return get(type, data_.data() + at_ + offset); }

 private:
  template <class T>
  double load(const char* p) const {
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), p, sizeof(T));
    if (swap_) std::reverse(bytes.begin(), bytes.end());
    return static_cast<double>(std::bit_cast<T>(bytes));
  }
  double get(PlyType type, const char* p) const {
    switch (type) {
      case PlyType::kInt8:
        return load<int8_t>(p);
      case PlyType::kUint8:
        return load<uint8_t>(p);
      case PlyType::kInt16:
        return load<int16_t>(p);
      case PlyType::kUint16:
        return load<uint16_t>(p);
      case PlyType::kInt32:
        return load<int32_t>(p);
      case PlyType::kUint32:
        return load<uint32_t>(p);
      case PlyType::kFloat32:
        return load<float>(p);
      case PlyType::kFloat64:
        return load<double>(p);
    }
    return 0;
  }

  std::string_view data_;
  size_t at_ = 0;
  bool swap_;
};

/// The same for text: values separated by blanks.
class AsciiValues {
 public:
  explicit AsciiValues(std::string_view data) : data_(data) {}

  static size_t least_bytes(PlyType) { return 2; }
  /// One more than there is, for the last value needs no separator.
  size_t remaining() const { return data_.size() - at_ + 1; }

  bool next(PlyType, double* value) {
    const auto blank = [](char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; };
    while (at_ < data_.size() && blank(data_[at_])) ++at_;
    const size_t begin = at_;
    while (at_ < data_.size() && !blank(data_[at_])) ++at_;
    if (begin == at_) return false;
    const std::string_view word = data_.substr(begin, at_ - begin);
    if (!parse_number(word, value)) {
      if (word == "nan" || word == "-nan" || word == "inf" || word == "-inf") {
        *value = std::numeric_limits<double>::quiet_NaN();
      } else {
        throw Error(ErrorKind::kBadScene, "holds " + in_quotes(word) + " where a number is expected");
      }
    }
    return true;
  }

 private:
  std::string_view data_;
  size_t at_ = 0;
};

}  // namespace lightmill
