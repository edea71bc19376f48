#include "worker/render/camera/perspective.h"

#include <cmath>

#include "common/error.h"

namespace lightmill {

PerspectiveCamera::PerspectiveCamera(const CameraDescription& description, int width, int height) {
  const auto& m = description.camera_to_world.m;
  // Axes without their lengths; the third from the file, so that a mirroring camera (Scale -1 1 1) mirrors.
  double axis[3][3];
  for (size_t j = 0; j < 3; ++j) {
    const double length = std::sqrt(m[0][j] * m[0][j] + m[1][j] * m[1][j] + m[2][j] * m[2][j]);
    if (!(length > 0) || !std::isfinite(length)) throw Error(ErrorKind::kBadScene, "the camera's transform is singular");
    for (size_t i = 0; i < 3; ++i) axis[j][i] = m[i][j] / length;
  }
  const double frame = description.frame_aspect_ratio.value_or(static_cast<double>(width) / height);
  std::array<double, 4> window = frame > 1 ? std::array<double, 4>{-frame, frame, -1, 1}
                                           : std::array<double, 4>{-1, 1, -1 / frame, 1 / frame};
  if (description.screen_window) window = *description.screen_window;
  const double t = std::tan(description.fov_degrees * M_PI / 360);
  for (size_t i = 0; i < 3; ++i) {
    right[i] = static_cast<float>(axis[0][i]);
    down[i] = static_cast<float>(-axis[1][i]);
    forward[i] = static_cast<float>(axis[2][i]);
  }
  tan_x0 = static_cast<float>(window[0] * t);
  tan_y0 = static_cast<float>(-window[3] * t);
  tan_per_pixel_x = static_cast<float>((window[1] - window[0]) * t / width);
  tan_per_pixel_y = static_cast<float>((window[3] - window[2]) * t / height);
  pixel_density = static_cast<float>(1 / ((window[1] - window[0]) * t / width * ((window[3] - window[2]) * t / height)));
}

}  // namespace lightmill
