#pragma once
// Tensor files, in which measured BSDFs are published (Dupuy & Jakob, "An Adaptive Parameterization for
// Efficient Material Acquisition and Rendering", 2018): named arrays of numbers, little endian.
//
//   "tensor_file\0"  bytes 1 0 (version)  uint32 fields; then per field
//   uint16 length  name  uint16 dimensions  uint8 type  uint64 offset in the file  uint64 size per dimension
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace lightmill {

/// Numbers of a field's type, of which only these two are used.
inline constexpr uint8_t kTensorFloat32 = 10, kTensorTypes = 12;

/// One array; the last index is the fastest. `shape` has 1 to 8 sizes, of which none is 0.
struct TensorField {
  std::string name;
  uint8_t type = 0;
  std::vector<size_t> shape;
  std::string_view bytes;  // into the file's, exactly as long as the shape says

  size_t count() const;  // of numbers
  /// Number i of a field of 32-bit floats.
  float number(size_t i) const;
};

/// The fields of a file whose contents outlive them. Throws Error(kBadScene) with a phrase such as "is
/// truncated: ..." for anything that is no sound file; allocates no more than the header's size.
std::vector<TensorField> parse_tensor_file(std::string_view data);

}  // namespace lightmill
