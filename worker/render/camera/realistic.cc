#include "worker/render/camera/realistic.h"

#include <cmath>

#include "worker/render/camera/camera_frame.h"

namespace lightmill {

static_assert(sizeof(PupilBounds) == 4 * sizeof(float));

RealisticCamera::RealisticCamera(const CameraDescription& description, int width, int height,
                                 int scale_exponent)
    : lenses(build_lenses(description.lens)),
      pupils(exit_pupils(lenses, description.lens.film_diagonal / 2000)) {
  const CameraFrame frame(description, width, height);
  for (int i = 0; i < 3; ++i) {
    right[i] = static_cast<float>(std::ldexp(frame.right[i] * frame.length[0], scale_exponent));
    up[i] = static_cast<float>(std::ldexp(-frame.down[i] * frame.length[1], scale_exponent));
    forward[i] = static_cast<float>(std::ldexp(frame.forward[i] * frame.length[2], scale_exponent));
  }
  const double diagonal = description.lens.film_diagonal / 1000;
  const double across = std::hypot(width, height);
  half_x = static_cast<float>(diagonal * width / across / 2);
  half_y = static_cast<float>(diagonal * height / across / 2);
  per_pixel_x = per_pixel_y = static_cast<float>(diagonal / across);
  pupils_per_metre = static_cast<float>(kPupils / (diagonal / 2));
  rear_z = lenses.interfaces.front().z;
}

}  // namespace lightmill
