#pragma once
// Collects the cubes of voxels of a sparse grid, and makes a field of them.
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "common/scene/volume/volume_grid.h"

namespace lightmill {

struct VoxelIndex {
  int64_t x, y, z;
};

class SparseVoxels {
 public:
  static constexpr int kSide = 8;  // of a leaf
  static constexpr int kLeafValues = kSide * kSide * kSide;
  using Leaf = std::array<float, kLeafValues>;  // z fastest

  /// `area`: bounds the memory of the voxels; null: nothing does.
  explicit SparseVoxels(std::shared_ptr<SpillArea> area)
      : values_(std::make_shared<SpillArray<float>>(std::move(area))) {}

  /// A leaf of voxels. Throws Error(kBadScene), as all of these, where there are too many or too far away.
  void add_leaf(const VoxelIndex& origin, const Leaf& values);
  /// A cube of `side` voxels of one value.
  void add_tile(const VoxelIndex& origin, int64_t side, float value);
  /// Values beyond all that is added are not 0, as they are taken for.
  void note_odd() { odd_ = true; }
  /// Moves all into `grid`, whose box in voxels this is, both ends inclusive. Throws if there is nothing, or
  /// its span has too many blocks.
  void write(const VoxelIndex& first, const VoxelIndex& last, VolumeGrid* grid);

 private:
  struct Cube {
    VoxelIndex origin;
    int64_t side;
    int32_t first;
  };
  float good(float x);
  void add_cube(const VoxelIndex& origin, int64_t side, int32_t first);

  std::vector<Cube> cubes_;
  std::shared_ptr<SpillArray<float>> values_;
  std::map<uint32_t, int32_t> tiles_;  // by the bits of their value: where it stands in `values_`
  bool odd_ = false;
};

}  // namespace lightmill
