#include "worker/render/camera/camera_motion.h"

#include <cmath>

#include "common/scene/motion.h"

namespace lightmill {

CameraMotion camera_motion_of(const SceneDescription& scene, int scale_exponent) {
  CameraMotion out;
  const CameraDescription& camera = scene.camera;
  if (camera.moves_to < 0) return out;
  const Transform& end = scene.later[static_cast<size_t>(camera.moves_to)];
  const Motion motion(camera.camera_to_world, end);
  out.moves = true;
  const double axis[3] = {motion.axis().x, motion.axis().y, motion.axis().z};
  out.turns = static_cast<float>(motion.degrees() / 360);
  for (size_t i = 0; i < 3; ++i) {
    out.axis[i] = static_cast<float>(axis[i]);
    out.shift[i] =
        static_cast<float>(std::ldexp(end.m[i][3] - camera.camera_to_world.m[i][3], scale_exponent));
  }
  return out;
}

}  // namespace lightmill
