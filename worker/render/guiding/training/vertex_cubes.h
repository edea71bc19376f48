#pragma once
// Finds the vertices near a point.
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <vector>

#include "worker/render/pipeline/work_items.h"

namespace lightmill {

/// Vertices in cubes of side `side`. All that are within `side` of a point are in the 27 cubes around it.
class VertexCubes {
 public:
  VertexCubes(const std::vector<Vertex>& vertices, float side) : side_(side) {
    for (size_t i = 0; i < vertices.size(); ++i)
      cubes_[cube_of(vertices[i].vec(Vertex::kP))].push_back(static_cast<int32_t>(i));
  }
  template <class Visit>
  void around(const Vec3<float>& p, Visit&& visit) const {
    const Cube middle = cube_of(p);
    for (int64_t x = middle[0] - 1; x <= middle[0] + 1; ++x) {
      for (int64_t y = middle[1] - 1; y <= middle[1] + 1; ++y) {
        for (auto c = cubes_.lower_bound({x, y, middle[2] - 1});
             c != cubes_.end() && c->first <= Cube{x, y, middle[2] + 1}; ++c)
          for (const int32_t i : c->second) visit(i);
      }
    }
  }

 private:
  using Cube = std::array<int64_t, 3>;
  Cube cube_of(const Vec3<float>& p) const {
    const auto along = [&](float x) { return static_cast<int64_t>(std::floor(x / side_)); };
    return {along(p.x), along(p.y), along(p.z)};
  }
  float side_;
  std::map<Cube, std::vector<int32_t>> cubes_;
};

}  // namespace lightmill
