#include "common/scene/volume/nanovdb.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>

#include "common/base/error.h"
#include "common/scene/transform.h"
#include "common/scene/volume/nanovdb_file.h"

namespace lightmill {
namespace {

constexpr int kBlock = 8;  // voxels a side of a leaf
constexpr int kBlockValues = kBlock * kBlock * kBlock;
constexpr int64_t kMostBlocks = int64_t{1} << 25;  // of its box
constexpr size_t kMostValues = (size_t{1} << 31) - 2 * kBlockValues;
constexpr int64_t kFarthest = int64_t{1} << 24;  // indices beyond it are not known to a voxel in float

[[noreturn]] void damaged(const std::string& what) {
  throw Error(ErrorKind::kBadScene, "is damaged: " + what);
}

/// The bytes of a grid; every read is checked.
class Bytes {
 public:
  explicit Bytes(const std::vector<char>& data) : data_(data) {}
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
  const std::vector<char>& data_;
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

struct Index {
  int64_t x, y, z;
};

class TreeReader {
 public:
  TreeReader(const std::vector<char>& data, VolumeValueKind kind) : in_(data), kind_(kind) {}

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
    if (cubes_.empty()) throw Error(ErrorKind::kBadScene, "has no voxels");
    write_field(&grid);
    return grid;
  }

 private:
  void read_root() {
    const uint64_t root = in_.child(kTree, in_.at<int64_t>(kTree + kRootOfTree));
    box_lo_ = {in_.at<int32_t>(root), in_.at<int32_t>(root + 4), in_.at<int32_t>(root + 8)};
    box_hi_ = {in_.at<int32_t>(root + 12), in_.at<int32_t>(root + 16), in_.at<int32_t>(root + 20)};
    const auto background = in_.at<float>(root + kBackground);
    if (background != 0) odd_ = true;  // beyond the grid there is nothing
    const uint64_t tiles = in_.at<uint32_t>(root + kTableSize);
    if (tiles > in_.size() / kTileSize) damaged("its root has more tiles than the grid has room for");
    for (uint64_t i = 0; i < tiles; ++i) {
      const uint64_t tile = root + kRootSize + i * kTileSize;
      const auto key = in_.at<uint64_t>(tile);
      const auto coordinate = [&](int shift) {
        return int64_t{static_cast<int32_t>(static_cast<uint32_t>(key >> shift & 0xfffff) << 12)};
      };
      const Index origin{coordinate(42), coordinate(21), coordinate(0)};
      const auto child = in_.at<int64_t>(tile + kTileChild);
      if (child != 0) {
        read_node(kUpper, in_.child(root, child), origin);
      } else {
        add_tile(in_.at<float>(tile + kTileValue), origin, 1 << 12);
      }
    }
  }

  void read_node(const NodeLayout& layout, uint64_t node, const Index& origin) {
    count(layout.bits == kUpper.bits ? &uppers_ : &lowers_, layout.size);
    const int n = 1 << layout.bits;
    for (int i = 0; i < n * n * n; ++i) {
      const Index at{origin.x + (int64_t{i >> 2 * layout.bits} << layout.extent),
                     origin.y + (int64_t{i >> layout.bits & (n - 1)} << layout.extent),
                     origin.z + (int64_t{i & (n - 1)} << layout.extent)};
      const uint64_t entry = node + layout.table + static_cast<uint64_t>(i) * 8;
      const auto mask = in_.at<uint64_t>(node + layout.child_mask + static_cast<uint64_t>(i / 64) * 8);
      if (!(mask >> (i % 64) & 1)) {
        add_tile(in_.at<float>(entry), at, int64_t{1} << layout.extent);
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

  void read_leaf(uint64_t leaf, const Index& origin) {
    count(&leaves_, kLeafTable);
    std::array<float, kBlockValues> v;
    bool any = false;
    for (int i = 0; i < kBlockValues; ++i) {
      // The file counts z fastest, a field x.
      const int to = (i & 7) * 64 + (i >> 3 & 7) * 8 + (i >> 6);
      v[static_cast<size_t>(to)] = good(value(leaf, static_cast<uint64_t>(i)));
      any = any || v[static_cast<size_t>(to)] != 0;
    }
    if (!any) return;
    add_cube(origin, kBlock, static_cast<int32_t>(values_.size()));
    values_.insert(values_.end(), v.begin(), v.end());
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

  float good(float x) {
    if (x >= 0 && std::isfinite(x)) return x;
    odd_ = true;
    return 0;
  }

  /// A cube of `side` voxels of one value.
  void add_tile(float x, const Index& origin, int64_t side) {
    x = good(x);
    if (x == 0) return;
    auto [known, is_new] =
        tiles_.try_emplace(std::bit_cast<uint32_t>(x), static_cast<int32_t>(values_.size()));
    if (is_new) values_.insert(values_.end(), kBlockValues, x);
    add_cube(origin, side, known->second);
  }

  void add_cube(const Index& origin, int64_t side, int32_t first) {
    for (const int64_t x : {origin.x, origin.y, origin.z}) {
      if (std::abs(x) > kFarthest) throw Error(ErrorKind::kBadScene, "has voxels beyond index 2^24");
    }
    if (values_.size() > kMostValues) throw Error(ErrorKind::kBadScene, "has more than 2^31 voxels");
    cubes_.push_back({origin, side, first});
  }

  /// A file may refer to a node again and again; there can't be more of them than fit into the grid.
  void count(uint64_t* visited, uint64_t least_size) {
    if (++*visited > in_.size() / least_size + 1) damaged("nodes refer to each other in circles");
  }

  void write_field(VolumeGrid* grid) {
    Index lo = cubes_.front().origin, hi = lo;
    for (const Cube& c : cubes_) {
      lo = {std::min(lo.x, c.origin.x), std::min(lo.y, c.origin.y), std::min(lo.z, c.origin.z)};
      const int64_t more = c.side - kBlock;
      hi = {std::max(hi.x, c.origin.x + more), std::max(hi.y, c.origin.y + more),
            std::max(hi.z, c.origin.z + more)};
    }
    const auto blocks = [](int64_t from, int64_t to) { return (to - from) / kBlock + 1; };
    const int64_t nx = blocks(lo.x, hi.x), ny = blocks(lo.y, hi.y), nz = blocks(lo.z, hi.z);
    if (nx * ny > kMostBlocks || nx * ny * nz > kMostBlocks)
      throw Error(ErrorKind::kBadScene, "spans more than 2^25 blocks of voxels");
    VolumeField& f = grid->field;
    f.nx = static_cast<int>(nx * kBlock), f.ny = static_cast<int>(ny * kBlock),
    f.nz = static_cast<int>(nz * kBlock);
    f.lo = {static_cast<double>(lo.x) - 0.5, static_cast<double>(lo.y) - 0.5,
            static_cast<double>(lo.z) - 0.5};
    f.hi = {f.lo.x + f.nx, f.lo.y + f.ny, f.lo.z + f.nz};
    f.blocks.assign(static_cast<size_t>(nx * ny * nz), -1);
    for (const Cube& c : cubes_) {
      const int64_t x = (c.origin.x - lo.x) / kBlock, y = (c.origin.y - lo.y) / kBlock,
                    z = (c.origin.z - lo.z) / kBlock, n = c.side / kBlock;
      for (int64_t k = z; k < z + n; ++k) {
        for (int64_t j = y; j < y + n; ++j)
          std::fill_n(f.blocks.begin() + ((k * ny + j) * nx + x), n, c.first);
      }
    }
    f.values = std::move(values_);
    const auto within = [](int32_t box, double least, double most) {
      return std::clamp(double{1} * box, least, most);
    };
    grid->lo = {within(box_lo_[0], f.lo.x, f.hi.x), within(box_lo_[1], f.lo.y, f.hi.y),
                within(box_lo_[2], f.lo.z, f.hi.z)};
    grid->hi = {within(box_hi_[0], f.lo.x, f.hi.x) + 1, within(box_hi_[1], f.lo.y, f.hi.y) + 1,
                within(box_hi_[2], f.lo.z, f.hi.z) + 1};
    grid->odd_values = odd_;
  }

  struct Cube {
    Index origin;
    int64_t side;
    int32_t first;
  };
  Bytes in_;
  VolumeValueKind kind_;
  uint64_t uppers_ = 0, lowers_ = 0, leaves_ = 0;
  std::array<int32_t, 3> box_lo_{}, box_hi_{};
  std::vector<Cube> cubes_;
  std::vector<float> values_;
  std::map<uint32_t, int32_t> tiles_;
  bool odd_ = false;
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

VolumeGrid read_nanovdb(const std::string& path, const std::string& name) {
  for (const NanoVdbEntry& e : nanovdb_entries(path)) {
    if (e.name != name) continue;
    if (const std::string why = why_not(e); !why.empty())
      throw Error(ErrorKind::kBadScene, "its grid \"" + name + "\" " + why);
    try {
      return TreeReader(nanovdb_bytes(path, e), e.kind).read();
    } catch (const Error& error) {
      throw Error(error.kind(), "its grid \"" + name + "\" " + error.what());
    }
  }
  throw Error(ErrorKind::kBadScene, "has no grid \"" + name + "\"");
}

}  // namespace lightmill
