#include "worker/render/camera/perspective.h"

#include <cmath>

#include "worker/render/camera/camera_frame.h"

namespace lightmill {
namespace {

/// Camera space's x (or y) unit in units of its z: 1 but for an anisotropic Scale, which stretches the image.
double stretch(double length, double length_z) {
  const double ratio = length / length_z;
  return std::fabs(ratio - 1) < 1e-6 ? 1 : ratio;
}

}  // namespace

PerspectiveCamera::PerspectiveCamera(const CameraDescription& description, int width, int height) {
  const CameraFrame frame(description, width, height);
  frame.store_axes(right, down, forward);
  const double* window = frame.window;
  const double t = std::tan(description.fov_degrees * M_PI / 360);
  const double tx = t * stretch(frame.length[0], frame.length[2]),
               ty = t * stretch(frame.length[1], frame.length[2]);
  tan_x0 = static_cast<float>(window[0] * tx);
  tan_y0 = static_cast<float>(-window[3] * ty);
  tan_per_pixel_x = static_cast<float>((window[1] - window[0]) * tx / width);
  tan_per_pixel_y = static_cast<float>((window[3] - window[2]) * ty / height);
  pixel_density = static_cast<float>(
      1 / ((window[1] - window[0]) * tx / width * ((window[3] - window[2]) * ty / height)));
}

}  // namespace lightmill
