#pragma once
// The box around points.
#include <algorithm>

#include "common/scene/transform.h"

namespace lightmill {

struct GltfBox {
  Vec3d low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};

  bool empty() const { return low.x > high.x; }
  void add(const Vec3d& p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  Vec3d corner(int i) const {
    return {i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z};
  }
};

}  // namespace lightmill
