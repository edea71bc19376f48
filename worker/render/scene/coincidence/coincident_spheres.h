#pragma once
// Spheres that coincide: as faces do (coincident_faces.h), their radii change instead. Spheres and faces
// touch in points alone.
#include <array>
#include <vector>

#include "worker/render/scene/coincidence/coincident_faces.h"

namespace lightmill {

/// A sphere in place.
struct PlacedSphere {
  std::array<float, 4> record;  // centre, radius; a radius of 0: not looked at
  double rounding = 0;          // as a mesh's
};

/// Changes radii of `spheres`; 0: the sphere is left out. found.left_out is not set.
CoincidentFaces separate_spheres(const std::vector<SurfaceTraits>& traits, const CoincidenceSpace& space,
                                 std::vector<PlacedSphere>* spheres);

}  // namespace lightmill
