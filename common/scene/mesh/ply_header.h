#pragma once
// The header of a PLY file.
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace lightmill {

enum class PlyFormat { kAscii, kLittleEndian, kBigEndian };
enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };
/// Size of a binary value in bytes.
size_t ply_type_size(PlyType type);
inline bool is_ply_integer(PlyType type) { return type < PlyType::kFloat32; }

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat32;
  bool is_list = false;
  PlyType count_type = PlyType::kUint8;  // of a list
};
struct PlyElement {
  std::string name;
  uint64_t count = 0;
  std::vector<PlyProperty> properties;
};
struct PlyHeader {
  PlyFormat format = PlyFormat::kAscii;
  std::vector<PlyElement> elements;
  size_t bytes = 0;  // where the data begin
};

/// Throws Error(kBadScene) with a phrase that says what is wrong.
PlyHeader parse_ply_header(std::string_view data);

}  // namespace lightmill
