#include "worker/render/camera/thin_lens.h"

#include <cmath>

#include "common/base/error.h"

namespace lightmill {

LensScale lens_scale(const CameraFrame& frame, const CameraDescription& description, int scale_exponent) {
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
  return {static_cast<float>(std::ldexp(x, scale_exponent)),
          static_cast<float>(std::ldexp(y, scale_exponent)), static_cast<float>(x / focus),
          static_cast<float>(y / focus)};
}

LensStop::LensStop(const LensBlades& blades) {
  if (blades.count < 3) return;
  corners = blades.count;
  const double turns = blades.rotation_degrees / 360;
  rotation = static_cast<float>(turns - std::floor(turns));
  apothem = static_cast<float>(std::cos(M_PI / blades.count));
  half_side = static_cast<float>(std::sin(M_PI / blades.count));
}

ThinLensCamera::ThinLensCamera(const CameraDescription& description, int width, int height,
                               int scale_exponent)
    : pinhole(description, width, height),
      lens(lens_scale(CameraFrame(description, width, height), description, scale_exponent)),
      stop(description.blades) {
  const auto squeeze = static_cast<float>(1 / description.blades.ratio);
  lens.radius_x *= squeeze;
  lens.shear_x *= squeeze;
}

}  // namespace lightmill
