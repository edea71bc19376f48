#pragma once
// Grids of NanoVDB files (OpenVDB's read-only layout; versions 32.x, as pbrt-v4 has it).
//
// The layout is a tree of nodes that refer to each other by offsets. A reader that trusts them reads
// anywhere, so this one checks each offset against the grid, and counts what it visits against what fits into
// one.
#include <string>
#include <vector>

#include "common/scene/medium_description.h"

namespace lightmill {

/// What a file says of a grid without reading its values.
struct VolumeGridEntry {
  std::string name;
  std::string why_not;  // it can't be a density ("is a level set"); empty: it can
};

/// A grid's values over its index space, where voxel i is at i. Negative and non-finite ones are 0.
struct VolumeGrid {
  VolumeField field;
  Transform index_to_world;  // affine, not singular
  Vec3d lo, hi;  // its box in index space, as pbrt has it: from the first voxel to one beyond the last
  bool odd_values = false;  // some were cut to 0
};

/// The grids of a file. Throws Error(kBadScene), without the path, if it is not a NanoVDB file.
std::vector<VolumeGridEntry> list_nanovdb(const std::string& path);
/// The grid of this name. Throws Error(kBadScene), without the path, if there is none or it is damaged.
VolumeGrid read_nanovdb(const std::string& path, const std::string& name);

}  // namespace lightmill
