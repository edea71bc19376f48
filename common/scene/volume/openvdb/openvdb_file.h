#pragma once
// The container of OpenVDB files: which grids there are and where, and their numbers one after the other,
// unpacked.
#include <cstdint>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "common/scene/scene_values.h"

namespace lightmill {

enum class OpenVdbValue { kFloat, kDouble, kOther };

struct OpenVdbEntry {
  std::string name;       // as a user knows it
  std::string full_name;  // the same with a number, where several grids have one name
  std::string parent;     // full name of the grid whose tree it shares, or empty
  OpenVdbValue value = OpenVdbValue::kOther;
  bool half = false;  // values are stored as half floats
  bool is_level_set = false;
  bool is_affine = true;
  uint64_t grid = 0, blocks = 0, end = 0;  // where in the file: its head, its leaves' values, what follows
};

/// The head of a grid, before its tree.
struct OpenVdbHead {
  bool is_level_set = false;
  std::optional<Transform> index_to_world;  // none: it is not affine
};

/// Whether a file begins as OpenVDB's do.
bool is_openvdb(const std::string& path);
/// Throws Error(kBadScene), without the path, if the file is cut short or of another version.
std::vector<OpenVdbEntry> openvdb_entries(const std::string& path);

/// Reads a file in order, from `begin` to `end` at most. All of it throws Error(kBadScene), without the path,
/// where the file ends or can't be unpacked.
class OpenVdbStream {
 public:
  OpenVdbStream(const std::string& path, uint64_t begin, uint64_t end);
  /// Reads the head of a grid, which also says how its values are packed. If it is affine, its tree is next.
  OpenVdbHead read_head();
  void seek(uint64_t offset);
  void read(void* to, uint64_t count);
  template <class T>
  T number() {
    T value;
    read(&value, sizeof value);
    return value;
  }
  std::string text();
  /// `count` values of a node or leaf of which `active` says which are on, packed as read_grid_head() found:
  /// those that are off may be stored as one or two values.
  void values(const OpenVdbEntry& entry, double background, const std::vector<uint64_t>& active,
              std::vector<double>* out);

 private:
  std::optional<Transform> read_map();
  void unpacked(std::vector<char>* out);
  double value(const OpenVdbEntry& entry);

  std::ifstream in_;
  uint64_t left_ = 0, file_size_ = 0;
  uint32_t packing_ = 0;
};

}  // namespace lightmill
