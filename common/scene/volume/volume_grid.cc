#include "common/scene/volume/volume_grid.h"

#include "common/scene/volume/nanovdb/nanovdb.h"
#include "common/scene/volume/openvdb/openvdb.h"
#include "common/scene/volume/openvdb/openvdb_file.h"

namespace lightmill {

std::vector<VolumeGridEntry> list_grids(const std::string& path) {
  return is_openvdb(path) ? list_openvdb(path) : list_nanovdb(path);
}

VolumeGrid read_grid(const std::string& path, const std::string& name,
                     const std::shared_ptr<SpillArea>& area) {
  return is_openvdb(path) ? read_openvdb(path, name, area) : read_nanovdb(path, name, area);
}

}  // namespace lightmill
