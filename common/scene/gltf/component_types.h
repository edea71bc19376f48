#pragma once
// The types of an accessor's components, and their numbers decoded.
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>

namespace lightmill {

enum ComponentType { kByte = 5120, kUnsignedByte, kShort, kUnsignedShort, kUnsignedInt = 5125, kFloat };

/// Bytes of a component; 0 for what glTF does not have.
inline size_t component_size(int64_t type) {
  switch (type) {
    case kByte:
    case kUnsignedByte:
      return 1;
    case kShort:
    case kUnsignedShort:
      return 2;
    case kUnsignedInt:
    case kFloat:
      return 4;
    default:
      return 0;
  }
}

template <class T>
T load_number(const unsigned char* from) {
  T x;
  std::memcpy(&x, from, sizeof x);
  return x;
}

/// Integers of N bits stand for [0, 1] or [-1, 1] when normalised.
template <class T>
float decoded(const unsigned char* from, bool normalized) {
  const auto x = static_cast<float>(load_number<T>(from));
  return normalized ? std::max(x / static_cast<float>(std::numeric_limits<T>::max()), -1.0f) : x;
}

/// A component as a float; integers of N bits are in [0, 1] or [-1, 1] when normalised.
inline float decode(const unsigned char* from, int type, bool normalized) {
  switch (type) {
    case kByte:
      return decoded<int8_t>(from, normalized);
    case kUnsignedByte:
      return decoded<uint8_t>(from, normalized);
    case kShort:
      return decoded<int16_t>(from, normalized);
    case kUnsignedShort:
      return decoded<uint16_t>(from, normalized);
    case kUnsignedInt:
      return decoded<uint32_t>(from, normalized);
    default:
      return load_number<float>(from);
  }
}

/// A component as an index; for the unsigned types.
inline uint32_t decode_index(const unsigned char* from, int type) {
  if (type == kUnsignedByte) return load_number<uint8_t>(from);
  if (type == kUnsignedShort) return load_number<uint16_t>(from);
  return load_number<uint32_t>(from);
}

inline bool is_index_type(int type) {
  return type == kUnsignedByte || type == kUnsignedShort || type == kUnsignedInt;
}

}  // namespace lightmill
