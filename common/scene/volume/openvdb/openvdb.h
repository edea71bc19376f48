#pragma once
// Grids of OpenVDB files (.vdb; file versions from 222 on, all of them as of 2026): as Blender, Houdini and
// most others write them. Museth, "VDB: High-Resolution Sparse Volumes with Dynamic Topology", 2013.
//
// A tree has a root, two levels of nodes of 32^3 and 16^3 children, and leaves of 8^3 voxels. The file has
// all nodes first, then the values of all leaves in the same order. The library that writes them trusts what
// it reads; this reader bounds all of it by the size of the file.
#include <string>
#include <vector>

#include "common/scene/volume/volume_grid.h"

namespace lightmill {

/// The grids of a file. Throws Error(kBadScene), without the path, if it is not an OpenVDB file or damaged.
std::vector<VolumeGridEntry> list_openvdb(const std::string& path);
/// The grid of this name; of several the first one. Throws Error(kBadScene), without the path, if there is
/// none or it is damaged.
VolumeGrid read_openvdb(const std::string& path, const std::string& name,
                        const std::shared_ptr<SpillArea>& area = nullptr);

}  // namespace lightmill
