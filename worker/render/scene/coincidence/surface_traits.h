#pragma once
// What a surface is to a ray that crosses it: what decides how surfaces that coincide are ordered.
#include "common/scene/description.h"

namespace lightmill {

struct SurfaceTraits {
  bool passes = false;  // light, somewhere
  bool masked = false;  // by alpha
  bool emits = false, one_sided = false;
  bool flipped = false;  // the outside is not that of the winding, or of a sphere
  int material = -1;
  bool boundary = false;
  MediumInterface media;
  SourceLocation location;
  /// Whether two that lie on each other are one.
  bool same_surface(const SurfaceTraits& o) const {
    return !masked && !o.masked && !emits && !o.emits && flipped == o.flipped && material == o.material &&
           boundary == o.boundary && media == o.media;
  }
};

/// Of `shape`, one of `scene`, whose mixes must not contain themselves.
SurfaceTraits surface_traits(const SceneDescription& scene, const ShapeDescription& shape);

}  // namespace lightmill
