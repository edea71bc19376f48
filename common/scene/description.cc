#include "common/scene/description.h"

#include "common/scene/transform.h"

namespace lightmill {

bool surface_flips_normal(const ShapeDescription& shape) {
  // A sphere's outward normal stays outward under a mirror; only a winding is swapped by one.
  if (std::holds_alternative<SphereShape>(shape.kind)) return shape.reverse_orientation;
  return shape.reverse_orientation != (determinant3(shape.object_to_world) < 0);
}

}  // namespace lightmill
