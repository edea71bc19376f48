#pragma once
// Straight lines through a lattice of cells, one per lane.
#include <limits>

#include "worker/render/pipeline/work_items.h"

namespace lightmill {

/// A cell, or a brick: its index along each axis.
struct LatticeCell {
  LaneInt x, y, z;
};

/// A line through a lattice, and where it leaves the cell of it that it is in.
struct LatticeLine {
  Vec3<Lane> o, d, inverse;
  LaneInt step_x, step_y, step_z;

  LatticeLine(const Vec3<Lane>& origin, const Vec3<Lane>& direction) : o(origin), d(direction) {
    const auto invert = [](Lane x) { return 1.0f / select(LaneMask(x == 0.0f), splat<Lane>(1.0f), x); };
    inverse = {invert(d.x), invert(d.y), invert(d.z)};
    const auto sign = [](Lane x) {
      return select(LaneMask(x < 0.0f), splat_int<Lane>(-1), splat_int<Lane>(1));
    };
    step_x = sign(d.x), step_y = sign(d.y), step_z = sign(d.z);
  }
  Vec3<Lane> at(Lane t) const { return {o.x + d.x * t, o.y + d.y * t, o.z + d.z * t}; }
  /// Where it meets the next plane of each axis. `side`: of the cells.
  Vec3<Lane> exits(const LatticeCell& c, int side) const {
    const auto exit = [&](Lane o1, Lane d1, Lane inverse1, LaneInt cell) {
      const LaneInt plane = (cell + select(LaneMask(d1 > 0.0f), splat_int<Lane>(1), LaneInt{})) * side;
      return select(LaneMask(d1 == 0.0f), splat<Lane>(std::numeric_limits<float>::infinity()),
                    (to_float(plane) - o1) * inverse1);
    };
    return {exit(o.x, d.x, inverse.x, c.x), exit(o.y, d.y, inverse.y, c.y), exit(o.z, d.z, inverse.z, c.z)};
  }
  /// Goes on to the next cell, across the nearest plane.
  void advance(const Vec3<Lane>& exits, LaneMask mask, LatticeCell* c) const {
    const LaneMask x = mask_and(LaneMask(exits.x <= exits.y), LaneMask(exits.x <= exits.z));
    const LaneMask y = mask_and(mask_not(x), LaneMask(exits.y <= exits.z));
    const LaneMask z = mask_and(mask, mask_not(mask_or(x, y)));
    c->x = select(mask_and(mask, x), c->x + step_x, c->x);
    c->y = select(mask_and(mask, y), c->y + step_y, c->y);
    c->z = select(z, c->z + step_z, c->z);
  }
};

inline Lane least(const Vec3<Lane>& v) { return min(v.x, min(v.y, v.z)); }

}  // namespace lightmill
