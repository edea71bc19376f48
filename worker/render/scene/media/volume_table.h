#pragma once
// Media that vary over a grid, as the kernels read them.
//
// A field's values are numbers on a lattice, linear in between. In *cell coordinates* voxel i is at i + 1; 0
// and n + 1 have the value outside. The lattice is cut into bricks of kBrick^3 cells, each with the
// (kBrick + 1)^3 values at its corners, so a value is looked up within one brick. Bricks without anything in
// them are one. Each brick of the coefficients has a majorant: an upper bound of the extinction in it.
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/base/spill/spill_array.h"
#include "worker/render/math/vec.h"

namespace lightmill {

inline constexpr int kBrickBits = 3;
inline constexpr int kBrick = 1 << kBrickBits;  // cells a side
inline constexpr int kBrickSide = kBrick + 1;   // values a side
inline constexpr int kBrickValues = kBrickSide * kBrickSide * kBrickSide;

/// Slots of a field's record: rows of the affine map from normalised space to cell coordinates; the number of
/// bricks along each axis, the place of its first brick in VolumeTable::bricks, and the largest cell
/// (integers by bits).
enum FieldSlot { kFieldMap = 0, kFieldBricks = 12, kFieldFirst = 15, kFieldLast = 16 };
inline constexpr int kFieldFloats = 20;

/// What shines in a grid: nothing; kMediumEmission per unit of the coefficients; the same times a field; the
/// absorption times a field of radiance.
inline constexpr int32_t kNoEmission = 0, kEvenEmission = 1, kScaledEmission = 2, kRgbEmission = 3;

/// Slots of a grid's record: its box in the cell coordinates of its coefficients; channels of these (1: a
/// factor of the medium's; 6: absorption and scattering, RGB, by themselves); which emission; where its
/// colours of black bodies begin in VolumeTable::values (or -1), and how many of them a kelvin has; its
/// fields; its light (or -1); the first of its poses (or -1) and how many segments they have.
inline constexpr int kGridLo = 0, kGridHi = 3, kGridChannels = 6, kGridEmissionKind = 7, kGridColors = 8,
                     kGridColorRate = 9, kGridCoefficients = 10,
                     kGridEmission = kGridCoefficients + kFieldFloats,
                     kGridTemperature = kGridEmission + kFieldFloats,
                     kGridLight = kGridTemperature + kFieldFloats, kGridPose = kGridLight + 1,
                     kGridSegments = kGridPose + 1, kGridFloats = kGridSegments + 1;
/// Colours of black bodies, evenly spaced from 0 kelvin to the hottest of a grid.
inline constexpr int kGridColorCount = 512;

/// A pose of a grid that moves: rows of A and the position p of the affine map x -> A x + p of normalised
/// space, which takes the grid from where it is as the shutter opens, which records describe, to where it is
/// then. Between two poses, which are at even times, floats change evenly. The first is the identity.
inline constexpr int kGridPoseFloats = 12;

struct VolumeTable {
  std::vector<float> records;    // kGridFloats per grid
  std::vector<int32_t> bricks;   // where a brick's values begin in `values`, x fastest
  std::vector<float> majorants;  // of the same bricks: see below
  /// Of the same bricks: density per unit of normalised volume with which next-event estimation draws points
  /// in them, given the grid's light. Empty if no grid shines.
  std::vector<float> drawn;
  SpillArray<float> values;  // channels of a brick one after the other, x fastest
  std::vector<float> poses;  // kGridPoseFloats each
  bool empty() const { return records.empty(); }
  bool any_moving() const { return !poses.empty(); }
};
// A majorant is the extinction per unit of normalised space that no channel exceeds in the brick. Paths are
// tracked against it: null collisions make up for the difference. It is negative where that would take more
// than kMostTracked tentative collisions for a way through the brick, and where nothing ends a segment: there
// the extinction is integrated, which is exact for what is linear between values.
//
// A plume of smoke, CPU time x variance with 1, 4, 16 and 1000: 0.107, 0.072, 0.033, 0.032. Of ten times the
// density, CPU seconds for the same samples and nearly the same variance with 16, 64, 128 and
// 1000: 15.7, 10.8, 9.7, 12.0; of a hundred times, with 16, 128 and 512: 12.3, 15.5, 17.3.
//
// Bricks of 4^3 cells were tried: a plume takes 0.96 and a fire in a room 1.15 times as long for 0.98 and
// 0.79 times the variance, with 1.4 times the memory.
inline constexpr float kMostTracked = 64;

/// Where a brick of a grid's coefficients lies along an axis, within the grid's box.
struct BrickSide {
  float from, until;  // in cell coordinates
  int32_t first_cell, last_cell;
  BrickSide(const float* grid, size_t axis, int32_t brick)
      : from(std::max(static_cast<float>(brick * kBrick), grid[kGridLo + axis])),
        until(std::max(from, std::min(static_cast<float>((brick + 1) * kBrick), grid[kGridHi + axis]))),
        first_cell(brick * kBrick),
        last_cell(std::min(brick * kBrick + kBrick - 1,
                           std::bit_cast<int32_t>(grid[kGridCoefficients + kFieldLast + axis]))) {}
};

/// A field per lane, of the record that begins at `record`.
template <class F>
struct FieldLanes {
  const VolumeTable& table;
  IntOf<F> record;

  F number(int slot) const { return gather(table.records.data() + slot, record); }
  IntOf<F> integer(int slot) const {
    return gather(reinterpret_cast<const int32_t*>(table.records.data()) + slot, record);
  }
  Vec3<F> direction(const Vec3<F>& v) const {
    const auto row = [&](int r) {
      return v.x * number(kFieldMap + r) + v.y * number(kFieldMap + r + 1) + v.z * number(kFieldMap + r + 2);
    };
    return {row(0), row(4), row(8)};
  }
  Vec3<F> point(const Vec3<F>& p) const {
    const Vec3<F> v = direction(p);
    return {v.x + number(kFieldMap + 3), v.y + number(kFieldMap + 7), v.z + number(kFieldMap + 11)};
  }
};

/// A cell of a field, and where in it a point is: in [0, 1] per axis.
template <class F>
struct FieldCell {
  IntOf<F> brick;   // its number in VolumeTable::bricks
  IntOf<F> corner;  // its first value in the brick
  Vec3<F> at;
};

template <class F>
inline IntOf<F> clamp_int(IntOf<F> x, IntOf<F> lo, IntOf<F> hi) {
  x = select(MaskOf<F>(x < lo), lo, x);
  return select(MaskOf<F>(x > hi), hi, x);
}

/// The bricks of a field: how many along x and y, and the number of the first.
template <class F>
struct FieldBricks {
  IntOf<F> nx{}, ny{}, first{};
};
template <class F>
inline FieldBricks<F> bricks_of(const FieldLanes<F>& field) {
  return {field.integer(kFieldBricks), field.integer(kFieldBricks + 1), field.integer(kFieldFirst)};
}

/// The cell with indices x, y, z, at cell coordinates p.
template <class F>
inline FieldCell<F> field_cell(const FieldBricks<F>& bricks, IntOf<F> x, IntOf<F> y, IntOf<F> z,
                               const Vec3<F>& p) {
  FieldCell<F> c;
  c.brick =
      bricks.first + ((z >> kBrickBits) * bricks.ny + (y >> kBrickBits)) * bricks.nx + (x >> kBrickBits);
  c.corner = ((z & (kBrick - 1)) * kBrickSide + (y & (kBrick - 1))) * kBrickSide + (x & (kBrick - 1));
  c.at = {clamp(p.x - to_float(x), 0.0f, 1.0f), clamp(p.y - to_float(y), 0.0f, 1.0f),
          clamp(p.z - to_float(z), 0.0f, 1.0f)};
  return c;
}
/// The cell that holds p; beyond the field the nearest one.
template <class F>
inline FieldCell<F> field_cell(const FieldLanes<F>& field, const Vec3<F>& p) {
  const auto index = [&](F x, int axis) {
    const IntOf<F> last = field.integer(kFieldLast + axis);
    return clamp_int<F>(to_int(floor(clamp(x, -1.0f, 1e9f))), IntOf<F>{}, last);
  };
  return field_cell<F>(bricks_of(field), index(p.x, 0), index(p.y, 1), index(p.z, 2), p);
}

/// The value of a channel.
template <class F>
inline F field_value(const VolumeTable& table, const FieldCell<F>& c, int channel = 0) {
  const IntOf<F> first = gather(table.bricks.data(), c.brick) + (c.corner + channel * kBrickValues);
  const float* const v = table.values.data();
  const auto along_x = [&](int offset) {
    const F a = gather(v + offset, first), b = gather(v + offset + 1, first);
    return a + (b - a) * c.at.x;
  };
  constexpr int kRow = kBrickSide, kLayer = kBrickSide * kBrickSide;
  const F y0 = along_x(0), y1 = along_x(kRow), z0 = y0 + (y1 - y0) * c.at.y;
  const F y2 = along_x(kLayer), y3 = along_x(kLayer + kRow), z1 = y2 + (y3 - y2) * c.at.y;
  return max(z0 + (z1 - z0) * c.at.z, F{});
}

}  // namespace lightmill
