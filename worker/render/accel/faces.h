#pragma once
// The triangles of a small scene as faces with shared corners.
//
// Two triangles in one plane that make a convex quadrangle are one face. Corners are told apart by where they
// are, so that faces of different meshes share them too.
#include <cstdint>
#include <vector>

#include "worker/render/scene/render_scene.h"

namespace lightmill {

struct FaceTable {
  struct Corner {
    float p[3];
  };
  struct Face {
    int32_t corner[4];  // in order; a triangle has its last one twice
    float at[3];        // the one next to the origin
    float normal[3];    // over a power of two
    /// So small beside the scene that rounding may put rays inside that pass it by far.
    bool tiny;
  };
  /// The triangles of a face: `second` is where across . p > offset.
  struct Halves {
    float across[3], offset;
    int32_t first, second;
    int32_t unused[2] = {};  // eight words are read in one go
  };

  std::vector<Corner> corners;
  std::vector<Face> faces;
  std::vector<Halves> halves;  // per face

  /// Of the triangles of the world; the time goes with the square of their number.
  explicit FaceTable(const RenderScene& scene);
};

}  // namespace lightmill
