#pragma once
// The container of NanoVDB files: which grids there are, and the bytes of one, unpacked.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/base/spill/spill_array.h"

namespace lightmill {

enum class VolumeValueKind { kFloat, kFp4, kFp8, kFp16, kFpN, kOther };

struct NanoVdbEntry {
  std::string name;
  VolumeValueKind kind = VolumeValueKind::kOther;
  bool is_level_set = false;
  uint64_t offset = 0, file_size = 0;  // in the file
  uint64_t grid_size = 0;              // unpacked
  uint16_t codec = 0;
};

/// Throws Error(kBadScene), without the path, if it is not a NanoVDB file, is cut short, or of another
/// version.
std::vector<NanoVdbEntry> nanovdb_entries(const std::string& path);
/// The grid itself, in memory that `area` bounds. Throws Error(kBadScene), without the path, if it can't be
/// unpacked, and what arrays throw that have no room.
SpillArray<char> nanovdb_bytes(const std::string& path, const NanoVdbEntry& entry,
                               const std::shared_ptr<SpillArea>& area);

}  // namespace lightmill
