#pragma once
// What every camera takes from its description: axes, their lengths and the window of its image plane.
#include "common/scene/description.h"

namespace lightmill {

struct CameraFrame {
  double right[3], down[3], forward[3];  // unit, world orientation; a mirroring transform mirrors
  double length[3];                      // of camera space's x, y and z axis in scene units
  double window[4];                      // x0, x1, y0, y1 of the image plane, y up, before any field of view

  /// Throws Error(kBadScene) if the axes are singular or not perpendicular.
  CameraFrame(const CameraDescription& description, int width, int height);
  /// The axes as the kernels read them.
  void store_axes(float r[3], float d[3], float f[3]) const;
};

}  // namespace lightmill
