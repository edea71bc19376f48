#pragma once
// The container of NanoVDB files: which grids there are, and the bytes of one, unpacked.
#include <cstdint>
#include <string>
#include <vector>

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
/// The grid itself. Throws Error(kBadScene), without the path, if it can't be unpacked.
std::vector<char> nanovdb_bytes(const std::string& path, const NanoVdbEntry& entry);

}  // namespace lightmill
