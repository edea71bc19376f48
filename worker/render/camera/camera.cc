#include "worker/render/camera/camera.h"

namespace lightmill {

Camera make_camera(const CameraDescription& description, int width, int height, int scale_exponent) {
  switch (description.kind) {
    case CameraKind::kOrthographic:
      if (description.lens_radius > 0) return ParallelLensCamera(description, width, height, scale_exponent);
      return OrthographicCamera(description, width, height, scale_exponent);
    case CameraKind::kSpherical:
      return SphericalCamera(description, width, height);
    case CameraKind::kFisheye:
      return FisheyeCamera(description, width, height);
    case CameraKind::kRealistic:
      return RealisticCamera(description, width, height, scale_exponent);
    case CameraKind::kPerspective:
      break;
  }
  if (description.lens_radius > 0) return ThinLensCamera(description, width, height, scale_exponent);
  return PerspectiveCamera(description, width, height);
}

}  // namespace lightmill
