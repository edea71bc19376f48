#pragma once
// PLY meshes: ascii, binary little and big endian, optionally gzip'd.
#include <string>
#include <string_view>

#include "common/scene/description.h"

namespace lightmill {

/// Largest PLY file, unpacked.
inline constexpr size_t kMaxPlyBytes = size_t{1} << 32;

/// Reads vertices (x y z, optional nx ny nz, optional u v | s t | texture_u texture_v | texture_s texture_t,
/// and of ours a second set u2 v2, and linear colours red green blue alpha as floats) and faces (lists of 3
/// or more indices of any integer type; polygons become fans). Other properties and elements are skipped.
/// Throws Error(kBadScene) with a phrase such as "is truncated: 12 of 40 vertices" on anything that is not a
/// sound mesh; memory stays within a small multiple of the data.
TriangleMesh parse_ply(std::string_view data);
/// The same from a file (gzip by its magic number).
TriangleMesh read_ply(const std::string& path);

}  // namespace lightmill
