#pragma once
// Where a grid that moves is at a time (VolumeTable::poses).
#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#include "worker/render/scene/media/volume_table.h"

namespace lightmill {

/// The way back from there to where its records have it.
struct GridReturn {
  double w[3][3];  // the inverse of A
  double position[3];
  double det;  // of A: volume there over volume in the records

  Vec3<float> vector(const Vec3<float>& v) const {
    const auto row = [&](int i) {
      return static_cast<float>(w[i][0] * double{v.x} + w[i][1] * double{v.y} + w[i][2] * double{v.z});
    };
    return {row(0), row(1), row(2)};
  }
  Vec3<float> point(const Vec3<float>& p) const {
    const double x = double{p.x} - position[0], y = double{p.y} - position[1], z = double{p.z} - position[2];
    const auto row = [&](int i) { return static_cast<float>(w[i][0] * x + w[i][1] * y + w[i][2] * z); };
    return {row(0), row(1), row(2)};
  }
};

/// Of the grid whose record begins at `record`, at `time` in [0, 1]; none if it stands still.
inline std::optional<GridReturn> return_of_grid(const VolumeTable& table, int32_t record, float time) {
  const auto integer = [&](int slot) {
    return std::bit_cast<int32_t>(table.records[static_cast<size_t>(record + slot)]);
  };
  const int32_t pose = integer(kGridPose), segments = integer(kGridSegments);
  if (pose < 0) return {};
  const float at = time * static_cast<float>(segments);  // exact: a power of two
  const int32_t step = std::min(static_cast<int32_t>(at), segments - 1);
  const float f = at - static_cast<float>(step);
  const float* const from = &table.poses[static_cast<size_t>(pose + step) * size_t{kGridPoseFloats}];
  double x[kGridPoseFloats];
  for (int i = 0; i < kGridPoseFloats; ++i)
    x[i] = double{from[i] + (from[i + kGridPoseFloats] - from[i]) * f};
  const auto a = [&](int row, int column) { return x[3 * (row % 3) + column % 3]; };
  GridReturn r;
  // Cyclic indices give the cofactor its sign.
  const auto cofactor = [&](int row, int column) {
    return a(row + 1, column + 1) * a(row + 2, column + 2) - a(row + 1, column + 2) * a(row + 2, column + 1);
  };
  r.det = a(0, 0) * cofactor(0, 0) + a(0, 1) * cofactor(0, 1) + a(0, 2) * cofactor(0, 2);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) r.w[i][j] = cofactor(j, i) / r.det;
    r.position[i] = x[9 + i];
  }
  return r;
}

}  // namespace lightmill
