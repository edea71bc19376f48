#include "worker/render/camera/thin_lens.h"

#include <cmath>

#include "common/error.h"
#include "worker/render/camera/camera_frame.h"

namespace lightmill {

ThinLensCamera::ThinLensCamera(const CameraDescription& description, int width, int height,
                               int scale_exponent)
    : pinhole(description, width, height) {
  const CameraFrame frame(description, width, height);
  const double x = description.lens_radius * frame.length[0], y = description.lens_radius * frame.length[1];
  const double focus = description.focal_distance * frame.length[2];
  // Beyond this, positions or slopes would leave float's range when squared.
  constexpr double kLargest = 0x1p40;
  if (!(std::ldexp(std::fmax(x, y), scale_exponent) < kLargest)) {
    throw Error(ErrorKind::kBadScene,
                "the camera's lens radius is more than 2^40 times the scene's size; lower \"lensradius\"");
  }
  if (!(std::fmax(x, y) / focus < kLargest)) {
    throw Error(
        ErrorKind::kBadScene,
        "the camera's lens radius is more than 2^40 times its focal distance; raise \"focaldistance\"");
  }
  radius_x = static_cast<float>(std::ldexp(x, scale_exponent));
  radius_y = static_cast<float>(std::ldexp(y, scale_exponent));
  shear_x = static_cast<float>(x / focus);
  shear_y = static_cast<float>(y / focus);
}

}  // namespace lightmill
