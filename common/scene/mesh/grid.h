#pragma once
// The triangles of a surface that is sampled on a grid.
#include "common/scene/description.h"

namespace lightmill {

/// Two triangles for each quad of a grid of (nu + 1) x (nv + 1) vertices, which are stored row by row.
inline void add_grid(int nu, int nv, TriangleMesh* mesh) {
  const auto index = [&](int i, int j) { return static_cast<uint32_t>(j * (nu + 1) + i); };
  for (int j = 0; j < nv; ++j) {
    for (int i = 0; i < nu; ++i) {
      mesh->triangles.push_back({index(i, j), index(i + 1, j), index(i + 1, j + 1)});
      mesh->triangles.push_back({index(i, j), index(i + 1, j + 1), index(i, j + 1)});
    }
  }
}

}  // namespace lightmill
