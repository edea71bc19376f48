#include "worker/render/camera/orthographic.h"

#include <algorithm>
#include <cmath>

#include "common/base/error.h"
#include "worker/render/camera/camera_frame.h"

namespace lightmill {

OrthographicCamera::OrthographicCamera(const CameraDescription& description, int width, int height,
                                       int scale_exponent) {
  const CameraFrame frame(description, width, height);
  frame.store_axes(right, down, forward);
  const double* window = frame.window;
  const double sx = std::ldexp(frame.length[0], scale_exponent),
               sy = std::ldexp(frame.length[1], scale_exponent);
  const double px = (window[1] - window[0]) * sx / width, py = (window[3] - window[2]) * sy / height;
  const double farthest = std::max({std::fabs(window[0]) * sx, std::fabs(window[1]) * sx,
                                    std::fabs(window[2]) * sy, std::fabs(window[3]) * sy});
  // Beyond this, positions or densities would leave float's range when squared.
  if (!(px > 0x1p-40 && py > 0x1p-40 && farthest < 0x1p40)) {
    throw Error(ErrorKind::kBadScene,
                "the orthographic camera's window is out of all proportion to the scene's size (a pixel "
                "below 2^-40 or "
                "an edge beyond 2^40 of it); mend \"screenwindow\" or the camera's scale");
  }
  x0 = static_cast<float>(window[0] * sx);
  y0 = static_cast<float>(-window[3] * sy);
  per_pixel_x = static_cast<float>(px);
  per_pixel_y = static_cast<float>(py);
  pixel_density = static_cast<float>(1 / (px * py));
}

}  // namespace lightmill
