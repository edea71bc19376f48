#include "common/scene/volume/openvdb/openvdb.h"

#include <algorithm>
#include <cmath>

#include "common/base/error.h"
#include "common/scene/transform.h"
#include "common/scene/volume/openvdb/openvdb_file.h"
#include "common/scene/volume/sparse_voxels.h"

namespace lightmill {
namespace {

constexpr int kLeafWords = SparseVoxels::kLeafValues / 64;

/// The levels between root and leaves: log2 of the children along an axis, and of a child's voxels.
struct Level {
  int bits, extent;
  int64_t side() const { return int64_t{1} << extent; }
  size_t children() const { return size_t{1} << 3 * bits; }
  VoxelIndex child(const VoxelIndex& origin, size_t i) const {
    const auto n = static_cast<int64_t>(i);
    const int64_t most = (1 << bits) - 1;
    return {origin.x + (n >> 2 * bits << extent), origin.y + ((n >> bits & most) << extent),
            origin.z + ((n & most) << extent)};
  }
};
constexpr Level kUpper{5, 7}, kLower{4, 3};

class TreeReader {
 public:
  /// `tree`: the grid whose tree is read.
  TreeReader(const std::string& path, const OpenVdbEntry& tree, std::shared_ptr<SpillArea> area)
      : in_(path, tree.grid, tree.end), tree_(tree), voxels_(std::move(area)) {}

  VolumeGrid read(const Transform& index_to_world) {
    VolumeGrid grid;
    grid.index_to_world = index_to_world;
    if (!is_in_range(grid.index_to_world) || is_singular(grid.index_to_world) ||
        determinant3(grid.index_to_world) == 0)
      throw Error(ErrorKind::kBadScene, "is damaged: its transform is singular");
    in_.read_head();
    read_root();
    in_.seek(tree_.blocks);
    for (const VoxelIndex& leaf : leaves_) read_leaf(leaf);
    voxels_.write(first_, last_, &grid);
    return grid;
  }

 private:
  double value() {
    return tree_.value == OpenVdbValue::kDouble ? in_.number<double>() : double{in_.number<float>()};
  }
  VoxelIndex index() {
    const auto x = in_.number<int32_t>(), y = in_.number<int32_t>(), z = in_.number<int32_t>();
    return {x, y, z};
  }

  void read_root() {
    if (in_.number<uint32_t>() != 1) throw Error(ErrorKind::kBadScene, "is damaged: it has no tree");
    background_ = value();
    if (background_ != 0) voxels_.note_odd();  // beyond the grid there is nothing
    const auto tiles = in_.number<uint32_t>(), children = in_.number<uint32_t>();
    for (uint32_t i = 0; i < tiles; ++i) {
      const VoxelIndex at = index();
      const double x = value();
      add_tile(at, kUpper.side() << kUpper.bits, x, in_.number<uint8_t>() != 0);
    }
    for (uint32_t i = 0; i < children; ++i) read_node(kUpper, index());
  }

  void read_node(const Level& level, const VoxelIndex& origin) {
    std::vector<uint64_t> child(level.children() / 64), active(child.size());
    in_.read(child.data(), child.size() * sizeof(uint64_t));
    in_.read(active.data(), active.size() * sizeof(uint64_t));
    std::vector<double> values(level.children());
    in_.values(tree_, background_, active, &values);
    const auto is_on = [](const std::vector<uint64_t>& mask, size_t i) {
      return (mask[i / 64] >> (i % 64) & 1) != 0;
    };
    for (size_t i = 0; i < values.size(); ++i) {
      if (!is_on(child, i)) add_tile(level.child(origin, i), level.side(), values[i], is_on(active, i));
    }
    for (size_t i = 0; i < values.size(); ++i) {
      if (!is_on(child, i)) continue;
      const VoxelIndex at = level.child(origin, i);
      if (level.bits == kUpper.bits) {
        read_node(kLower, at);
      } else {
        uint64_t mask[kLeafWords];  // once more with the values
        in_.read(mask, sizeof mask);
        leaves_.push_back(at);
      }
    }
  }

  void read_leaf(const VoxelIndex& origin) {
    mask_.resize(kLeafWords);
    in_.read(mask_.data(), kLeafWords * sizeof(uint64_t));
    values_.resize(SparseVoxels::kLeafValues);
    in_.values(tree_, background_, mask_, &values_);
    SparseVoxels::Leaf leaf;
    for (size_t i = 0; i < leaf.size(); ++i) {
      const bool on = (mask_[i / 64] >> (i % 64) & 1) != 0;
      leaf[i] = on || values_[i] != background_ ? static_cast<float>(values_[i]) : 0;
      if (!on) continue;
      const auto n = static_cast<int64_t>(i);
      extend({origin.x + (n >> 6), origin.y + (n >> 3 & 7), origin.z + (n & 7)}, 1);
    }
    voxels_.add_leaf(origin, leaf);
  }

  void add_tile(const VoxelIndex& at, int64_t side, double x, bool on) {
    if (!on && x == background_) return;
    voxels_.add_tile(at, side, static_cast<float>(x));
    if (on) extend(at, side);
  }

  /// The box of what is on.
  void extend(const VoxelIndex& at, int64_t side) {
    first_ = {std::min(first_.x, at.x), std::min(first_.y, at.y), std::min(first_.z, at.z)};
    last_ = {std::max(last_.x, at.x + side - 1), std::max(last_.y, at.y + side - 1),
             std::max(last_.z, at.z + side - 1)};
  }

  OpenVdbStream in_;
  const OpenVdbEntry& tree_;
  double background_ = 0;
  std::vector<VoxelIndex> leaves_;
  std::vector<uint64_t> mask_;
  std::vector<double> values_;
  SparseVoxels voxels_;
  static constexpr int64_t kFar = int64_t{1} << 40;
  VoxelIndex first_{kFar, kFar, kFar}, last_{-kFar, -kFar, -kFar};
};

std::string why_not(const OpenVdbEntry& e) {
  if (e.value == OpenVdbValue::kOther) return "has values that are no floats";
  if (e.is_level_set) return "is a level set";
  if (!e.is_affine) return "is tapered, which is not supported";
  return "";
}

}  // namespace

std::vector<VolumeGridEntry> list_openvdb(const std::string& path) {
  std::vector<VolumeGridEntry> grids;
  for (const OpenVdbEntry& e : openvdb_entries(path)) grids.push_back({e.name, why_not(e)});
  return grids;
}

VolumeGrid read_openvdb(const std::string& path, const std::string& name,
                        const std::shared_ptr<SpillArea>& area) {
  const std::vector<OpenVdbEntry> entries = openvdb_entries(path);
  const auto found = std::ranges::find(entries, name, &OpenVdbEntry::name);
  if (found == entries.end()) throw Error(ErrorKind::kBadScene, "has no grid \"" + name + "\"");
  if (const std::string why = why_not(*found); !why.empty())
    throw Error(ErrorKind::kBadScene, "its grid \"" + name + "\" " + why);
  try {
    const Transform index_to_world = *OpenVdbStream(path, found->grid, found->end).read_head().index_to_world;
    auto tree = found;
    if (!found->parent.empty()) {
      tree = std::ranges::find(entries, found->parent, &OpenVdbEntry::full_name);
      if (tree == entries.end() || !tree->parent.empty() || tree->value == OpenVdbValue::kOther ||
          !tree->is_affine)
        throw Error(ErrorKind::kBadScene, "shares the tree of another one, which is not there");
    }
    return TreeReader(path, *tree, area).read(index_to_world);
  } catch (const Error& error) {
    throw Error(error.kind(), "its grid \"" + name + "\" " + error.what());
  }
}

}  // namespace lightmill
