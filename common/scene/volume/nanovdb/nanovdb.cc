#include "common/scene/volume/nanovdb/nanovdb.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "common/base/error.h"
#include "common/scene/transform.h"
#include "common/scene/volume/nanovdb/nanovdb_file.h"
#include "common/scene/volume/sparse_voxels.h"

namespace lightmill {
namespace {

[[noreturn]] void damaged(const std::string& what) {
  throw Error(ErrorKind::kBadScene, "is damaged: " + what);
}

/// The bytes of a grid; every read is checked.
class Bytes {
 public:
  explicit Bytes(const SpillArray<char>& data) : data_(data) {}
  template <class T>
  T at(uint64_t offset) const {
    T value;
    if (offset > data_.size() || data_.size() - offset < sizeof value)
      damaged("an offset leads out of the grid");
    std::memcpy(&value, data_.data() + offset, sizeof value);
    return value;
  }
  /// The node that an offset leads to from another one.
  uint64_t child(uint64_t from, int64_t offset) const {
    const auto to = from + static_cast<uint64_t>(offset);
    if (to >= data_.size()) damaged("a node lies outside of the grid");
    return to;
  }
  uint64_t size() const { return data_.size(); }

 private:
  const SpillArray<char>& data_;
};

// Places in the layout, in bytes, of grids of floats, plain or quantised.
constexpr uint64_t kMap = 296, kMatrix = kMap + 88, kTranslation = kMap + 232, kTree = 672, kRootOfTree = 24;
constexpr uint64_t kTableSize = 24, kBackground = 28, kRootSize = 64;
constexpr uint64_t kTileSize = 32, kTileChild = 8, kTileValue = 20;

/// A node between root and leaves: masks and table, and how children are numbered.
struct NodeLayout {
  uint64_t child_mask, table, size;
  int bits;    // of an index along one axis
  int extent;  // log2 of a child's voxels along one axis
};
constexpr NodeLayout kUpper{4128, 8256, 270400, 5, 7}, kLower{544, 1088, 33856, 4, 3};
constexpr uint64_t kLeafFlags = 12, kLeafMinimum = 80, kLeafQuantum = 84, kLeafTable = 96;

class TreeReader {
 public:
  TreeReader(const SpillArray<char>& data, VolumeValueKind kind, std::shared_ptr<SpillArea> area)
      : in_(data), kind_(kind), voxels_(std::move(area)) {}

  VolumeGrid read() {
    VolumeGrid grid;
    for (size_t row = 0; row < 3; ++row) {
      for (size_t column = 0; column < 3; ++column)
        grid.index_to_world.m[row][column] = in_.at<double>(kMatrix + 8 * (3 * row + column));
      grid.index_to_world.m[row][3] = in_.at<double>(kTranslation + 8 * row);
    }
    if (!is_in_range(grid.index_to_world) || is_singular(grid.index_to_world) ||
        determinant3(grid.index_to_world) == 0)
      damaged("its transform is singular");
    read_root();
    voxels_.write({box_lo_[0], box_lo_[1], box_lo_[2]}, {box_hi_[0], box_hi_[1], box_hi_[2]}, &grid);
    return grid;
  }

 private:
  void read_root() {
    const uint64_t root = in_.child(kTree, in_.at<int64_t>(kTree + kRootOfTree));
    box_lo_ = {in_.at<int32_t>(root), in_.at<int32_t>(root + 4), in_.at<int32_t>(root + 8)};
    box_hi_ = {in_.at<int32_t>(root + 12), in_.at<int32_t>(root + 16), in_.at<int32_t>(root + 20)};
    const auto background = in_.at<float>(root + kBackground);
    if (background != 0) voxels_.note_odd();  // beyond the grid there is nothing
    const uint64_t tiles = in_.at<uint32_t>(root + kTableSize);
    if (tiles > in_.size() / kTileSize) damaged("its root has more tiles than the grid has room for");
    for (uint64_t i = 0; i < tiles; ++i) {
      const uint64_t tile = root + kRootSize + i * kTileSize;
      const auto key = in_.at<uint64_t>(tile);
      const auto coordinate = [&](int shift) {
        return int64_t{static_cast<int32_t>(static_cast<uint32_t>(key >> shift & 0xfffff) << 12)};
      };
      const VoxelIndex origin{coordinate(42), coordinate(21), coordinate(0)};
      const auto child = in_.at<int64_t>(tile + kTileChild);
      if (child != 0) {
        read_node(kUpper, in_.child(root, child), origin);
      } else {
        voxels_.add_tile(origin, 1 << 12, in_.at<float>(tile + kTileValue));
      }
    }
  }

  void read_node(const NodeLayout& layout, uint64_t node, const VoxelIndex& origin) {
    count(layout.bits == kUpper.bits ? &uppers_ : &lowers_, layout.size);
    const int n = 1 << layout.bits;
    for (int i = 0; i < n * n * n; ++i) {
      const VoxelIndex at{origin.x + (int64_t{i >> 2 * layout.bits} << layout.extent),
                          origin.y + (int64_t{i >> layout.bits & (n - 1)} << layout.extent),
                          origin.z + (int64_t{i & (n - 1)} << layout.extent)};
      const uint64_t entry = node + layout.table + static_cast<uint64_t>(i) * 8;
      const auto mask = in_.at<uint64_t>(node + layout.child_mask + static_cast<uint64_t>(i / 64) * 8);
      if (!(mask >> (i % 64) & 1)) {
        voxels_.add_tile(at, int64_t{1} << layout.extent, in_.at<float>(entry));
        continue;
      }
      const uint64_t child = in_.child(node, in_.at<int64_t>(entry));
      if (layout.bits == kUpper.bits) {
        read_node(kLower, child, at);
      } else {
        read_leaf(child, at);
      }
    }
  }

  void read_leaf(uint64_t leaf, const VoxelIndex& origin) {
    count(&leaves_, kLeafTable);
    SparseVoxels::Leaf v;
    for (size_t i = 0; i < v.size(); ++i) v[i] = value(leaf, i);
    voxels_.add_leaf(origin, v);
  }

  float value(uint64_t leaf, uint64_t i) const {
    if (kind_ == VolumeValueKind::kFloat) return in_.at<float>(leaf + kLeafTable + 4 * i);
    const uint32_t log_bits = kind_ == VolumeValueKind::kFp4   ? 2
                              : kind_ == VolumeValueKind::kFp8 ? 3
                              : kind_ == VolumeValueKind::kFp16
                                  ? 4
                                  : std::min(in_.at<uint32_t>(leaf + kLeafFlags) >> 29, 4u);
    const uint32_t bits = 1u << log_bits;
    const auto word = in_.at<uint32_t>(leaf + kLeafTable + ((i << log_bits) >> 5) * 4);
    const uint32_t q = word >> ((i << log_bits) & 31) & ((1u << bits) - 1);
    return static_cast<float>(q) * in_.at<float>(leaf + kLeafQuantum) + in_.at<float>(leaf + kLeafMinimum);
  }

  /// A file may refer to a node again and again; there can't be more of them than fit into the grid.
  void count(uint64_t* visited, uint64_t least_size) {
    if (++*visited > in_.size() / least_size + 1) damaged("nodes refer to each other in circles");
  }

  Bytes in_;
  VolumeValueKind kind_;
  uint64_t uppers_ = 0, lowers_ = 0, leaves_ = 0;
  std::array<int32_t, 3> box_lo_{}, box_hi_{};
  SparseVoxels voxels_;
};

std::string why_not(const NanoVdbEntry& e) {
  if (e.is_level_set) return "is a level set";
  if (e.kind == VolumeValueKind::kOther) return "has values that are no floats";
  return "";
}

}  // namespace

std::vector<VolumeGridEntry> list_nanovdb(const std::string& path) {
  std::vector<VolumeGridEntry> grids;
  for (const NanoVdbEntry& e : nanovdb_entries(path)) grids.push_back({e.name, why_not(e)});
  return grids;
}

VolumeGrid read_nanovdb(const std::string& path, const std::string& name,
                        const std::shared_ptr<SpillArea>& area) {
  for (const NanoVdbEntry& e : nanovdb_entries(path)) {
    if (e.name != name) continue;
    if (const std::string why = why_not(e); !why.empty())
      throw Error(ErrorKind::kBadScene, "its grid \"" + name + "\" " + why);
    try {
      return TreeReader(nanovdb_bytes(path, e, area), e.kind, area).read();
    } catch (const Error& error) {
      throw Error(error.kind(), "its grid \"" + name + "\" " + error.what());
    }
  }
  throw Error(ErrorKind::kBadScene, "has no grid \"" + name + "\"");
}

}  // namespace lightmill
