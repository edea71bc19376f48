#pragma once
// Grids of files of volumes, whatever their format.
#include <memory>
#include <string>
#include <vector>

#include "common/base/spill/spill_area.h"
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

/// The grids of an OpenVDB or NanoVDB file; which of them it is its first bytes say. Throws Error(kBadScene),
/// without the path, if it is neither or damaged.
std::vector<VolumeGridEntry> list_grids(const std::string& path);
/// The grid of this name, in memory that `area` bounds (null: nothing does). Throws Error(kBadScene), without
/// the path, if there is none or it is damaged, and what arrays throw that have no room (spill_array.h).
VolumeGrid read_grid(const std::string& path, const std::string& name,
                     const std::shared_ptr<SpillArea>& area = nullptr);

}  // namespace lightmill
