#include "worker/render/scene/coincidence/corner_moves.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace lightmill {
namespace {

/// Where wishes for one corner take it.
Vec3d move_of(const CornerWish* begin, const CornerWish* end) {
  constexpr int kRounds = 32;
  const int rounds = end - begin > 1 ? kRounds : 1;
  Vec3d d;
  for (int round = 0; round < rounds; ++round) {
    for (const CornerWish* w = begin; w != end; ++w) {
      const double missing = w->by - along(d, w->normal);
      const bool beyond = w->by != 0 && missing * w->by < 0;
      if (beyond) continue;
      d = {d.x + missing * w->normal.x, d.y + missing * w->normal.y, d.z + missing * w->normal.z};
    }
  }
  return d;
}

}  // namespace

double move_corners(std::vector<CornerWish> wishes, const std::vector<PlacedMesh>& meshes,
                    const std::vector<std::optional<MeshBodies>>& bodies, float* positions) {
  const auto plane = [](const CornerWish& w) { return std::tuple(w.mesh, w.corner, w.plane); };
  std::stable_sort(wishes.begin(), wishes.end(), [&](const CornerWish& a, const CornerWish& b) {
    return std::tuple(plane(a), -std::fabs(a.by)) < std::tuple(plane(b), -std::fabs(b.by));
  });
  wishes.erase(std::unique(wishes.begin(), wishes.end(),
                           [&](const CornerWish& a, const CornerWish& b) { return plane(a) == plane(b); }),
               wishes.end());
  std::map<uint32_t, std::map<uint32_t, Vec3d>> moves;
  double longest = 0;
  for (auto i = wishes.begin(); i != wishes.end();) {
    const auto end = std::find_if(
        i, wishes.end(), [&](const CornerWish& w) { return w.mesh != i->mesh || w.corner != i->corner; });
    if (std::any_of(i, end, [](const CornerWish& w) { return w.by != 0; })) {
      const Vec3d d = move_of(&*i, &*i + (end - i));
      longest = std::max(longest, std::sqrt(along(d, d)));
      moves[i->mesh].emplace(i->corner, d);
    }
    i = end;
  }
  for (const auto& [m, by] : moves) {
    const MeshBodies& of = *bodies[m];
    for (uint32_t v = 0; v < of.vertex_count(); ++v) {
      const auto at = by.find(of.corner(v));
      if (at == by.end()) continue;
      float* p = positions + 3 * (meshes[m].first_vertex + v);
      const double to[3] = {p[0] + at->second.x, p[1] + at->second.y, p[2] + at->second.z};
      for (int k = 0; k < 3; ++k) p[k] = static_cast<float>(to[k]);
    }
  }
  return longest;
}

}  // namespace lightmill
