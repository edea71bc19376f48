#pragma once
// The cameras: a closed set. Kernels visit it once per group of lanes and are compiled for each.
#include <variant>

#include "worker/render/camera/fisheye.h"
#include "worker/render/camera/orthographic.h"
#include "worker/render/camera/parallel_lens.h"
#include "worker/render/camera/perspective.h"
#include "worker/render/camera/realistic.h"
#include "worker/render/camera/spherical.h"
#include "worker/render/camera/thin_lens.h"

namespace lightmill {

using Camera = std::variant<PerspectiveCamera, ThinLensCamera, OrthographicCamera, ParallelLensCamera,
                            SphericalCamera, RealisticCamera, FisheyeCamera>;

/// The camera of `description` in normalised space, whose lengths are 2^scale_exponent scene units. A
/// perspective camera without a lens radius is the pinhole, an orthographic one sharp everywhere. Throws
/// Error(kBadScene).
Camera make_camera(const CameraDescription& description, int width, int height, int scale_exponent);

/// See CameraRay.
inline bool is_parallel(const Camera& camera) {
  return std::visit([](const auto& c) { return c.kParallel; }, camera);
}

/// The camera if it is a spherical one whose raster goes on on its other side, else null.
inline const SphericalCamera* round_sphere(const Camera& camera) {
  const auto* sphere = std::get_if<SphericalCamera>(&camera);
  return sphere && sphere->round_x ? sphere : nullptr;
}

}  // namespace lightmill
