#pragma once
// Grids of NanoVDB files (OpenVDB's read-only layout; versions 32.x, as pbrt-v4 has it).
//
// The layout is a tree of nodes that refer to each other by offsets. A reader that trusts them reads
// anywhere, so this one checks each offset against the grid, and counts what it visits against what fits into
// one.
#include <string>
#include <vector>

#include "common/scene/volume/volume_grid.h"

namespace lightmill {

/// The grids of a file. Throws Error(kBadScene), without the path, if it is not a NanoVDB file.
std::vector<VolumeGridEntry> list_nanovdb(const std::string& path);
/// The grid of this name. Throws Error(kBadScene), without the path, if there is none or it is damaged.
VolumeGrid read_nanovdb(const std::string& path, const std::string& name,
                        const std::shared_ptr<SpillArea>& area = nullptr);

}  // namespace lightmill
