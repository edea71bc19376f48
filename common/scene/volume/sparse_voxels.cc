#include "common/scene/volume/sparse_voxels.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/base/error.h"

namespace lightmill {
namespace {

constexpr int64_t kMostBlocks = int64_t{1} << 25;  // of its box
constexpr size_t kMostValues = (size_t{1} << 31) - 2 * SparseVoxels::kLeafValues;
constexpr int64_t kFarthest = int64_t{1} << 24;  // indices beyond it are not known to a voxel in float

}  // namespace

float SparseVoxels::good(float x) {
  if (x >= 0 && std::isfinite(x)) return x;
  odd_ = true;
  return 0;
}

void SparseVoxels::add_leaf(const VoxelIndex& origin, const Leaf& values) {
  Leaf v;
  bool any = false;
  for (int i = 0; i < kLeafValues; ++i) {
    // The files count z fastest, a field x.
    const int to = (i & 7) * 64 + (i >> 3 & 7) * 8 + (i >> 6);
    v[static_cast<size_t>(to)] = good(values[static_cast<size_t>(i)]);
    any = any || v[static_cast<size_t>(to)] != 0;
  }
  if (!any) return;
  add_cube(origin, kSide, static_cast<int32_t>(values_->size()));
  values_->append(v.data(), v.size());
}

void SparseVoxels::add_tile(const VoxelIndex& origin, int64_t side, float value) {
  const float x = good(value);
  if (x == 0) return;
  auto [known, is_new] =
      tiles_.try_emplace(std::bit_cast<uint32_t>(x), static_cast<int32_t>(values_->size()));
  if (is_new) {
    Leaf all;
    all.fill(x);
    values_->append(all.data(), all.size());
  }
  add_cube(origin, side, known->second);
}

void SparseVoxels::add_cube(const VoxelIndex& origin, int64_t side, int32_t first) {
  for (const int64_t x : {origin.x, origin.y, origin.z}) {
    if (std::abs(x) > kFarthest) throw Error(ErrorKind::kBadScene, "has voxels beyond index 2^24");
  }
  if (values_->size() > kMostValues) throw Error(ErrorKind::kBadScene, "has more than 2^31 voxels");
  cubes_.push_back({origin, side, first});
}

void SparseVoxels::write(const VoxelIndex& first, const VoxelIndex& last, VolumeGrid* grid) {
  if (cubes_.empty()) throw Error(ErrorKind::kBadScene, "has no voxels");
  VoxelIndex lo = cubes_.front().origin, hi = lo;
  for (const Cube& c : cubes_) {
    lo = {std::min(lo.x, c.origin.x), std::min(lo.y, c.origin.y), std::min(lo.z, c.origin.z)};
    const int64_t more = c.side - kSide;
    hi = {std::max(hi.x, c.origin.x + more), std::max(hi.y, c.origin.y + more),
          std::max(hi.z, c.origin.z + more)};
  }
  const auto blocks = [](int64_t from, int64_t to) { return (to - from) / kSide + 1; };
  const int64_t nx = blocks(lo.x, hi.x), ny = blocks(lo.y, hi.y), nz = blocks(lo.z, hi.z);
  if (nx * ny > kMostBlocks || nx * ny * nz > kMostBlocks)
    throw Error(ErrorKind::kBadScene, "spans more than 2^25 blocks of voxels");
  VolumeField& f = grid->field;
  f.nx = static_cast<int>(nx * kSide), f.ny = static_cast<int>(ny * kSide),
  f.nz = static_cast<int>(nz * kSide);
  f.lo = {static_cast<double>(lo.x) - 0.5, static_cast<double>(lo.y) - 0.5, static_cast<double>(lo.z) - 0.5};
  f.hi = {f.lo.x + f.nx, f.lo.y + f.ny, f.lo.z + f.nz};
  f.blocks.assign(static_cast<size_t>(nx * ny * nz), -1);
  for (const Cube& c : cubes_) {
    const int64_t x = (c.origin.x - lo.x) / kSide, y = (c.origin.y - lo.y) / kSide,
                  z = (c.origin.z - lo.z) / kSide, n = c.side / kSide;
    for (int64_t k = z; k < z + n; ++k) {
      for (int64_t j = y; j < y + n; ++j) std::fill_n(f.blocks.begin() + ((k * ny + j) * nx + x), n, c.first);
    }
  }
  f.block_values = std::move(values_);
  const auto within = [](int64_t box, double least, double most) {
    return std::clamp(static_cast<double>(box), least, most);
  };
  grid->lo = {within(first.x, f.lo.x, f.hi.x), within(first.y, f.lo.y, f.hi.y),
              within(first.z, f.lo.z, f.hi.z)};
  grid->hi = {within(last.x, f.lo.x, f.hi.x) + 1, within(last.y, f.lo.y, f.hi.y) + 1,
              within(last.z, f.lo.z, f.hi.z) + 1};
  grid->odd_values = odd_;
}

}  // namespace lightmill
