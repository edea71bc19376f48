#include "worker/render/camera/camera_frame.h"

#include <algorithm>
#include <cmath>

#include "common/base/error.h"

namespace lightmill {

CameraFrame::CameraFrame(const CameraDescription& description, int width, int height) {
  const auto& m = description.camera_to_world.m;
  // Axes without their lengths; the third from the file, so that a mirroring camera (Scale -1 1 1) mirrors.
  double axis[3][3];
  for (size_t j = 0; j < 3; ++j) {
    length[j] = std::sqrt(m[0][j] * m[0][j] + m[1][j] * m[1][j] + m[2][j] * m[2][j]);
    if (!(length[j] > 0) || !std::isfinite(length[j])) {
      throw Error(ErrorKind::kBadScene, "the camera's transform is singular");
    }
    for (size_t i = 0; i < 3; ++i) axis[j][i] = m[i][j] / length[j];
  }
  for (size_t j = 0; j < 3; ++j) {
    const double *a = axis[j], *b = axis[(j + 1) % 3];
    if (std::fabs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) > 1e-3) {
      throw Error(ErrorKind::kBadScene, "the camera's transform shears: its axes must be perpendicular");
    }
  }
  const double frame = description.frame_aspect_ratio.value_or(static_cast<double>(width) / height);
  std::array<double, 4> w = frame > 1 ? std::array<double, 4>{-frame, frame, -1, 1}
                                      : std::array<double, 4>{-1, 1, -1 / frame, 1 / frame};
  if (description.screen_window) w = *description.screen_window;
  std::copy(w.begin(), w.end(), window);
  for (size_t i = 0; i < 3; ++i) {
    right[i] = axis[0][i];
    down[i] = -axis[1][i];
    forward[i] = axis[2][i];
  }
}

void CameraFrame::store_axes(float r[3], float d[3], float f[3]) const {
  for (size_t i = 0; i < 3; ++i) {
    r[i] = static_cast<float>(right[i]);
    d[i] = static_cast<float>(down[i]);
    f[i] = static_cast<float>(forward[i]);
  }
}

}  // namespace lightmill
