#include "worker/render/camera/parallel_lens.h"

namespace lightmill {

ParallelLensCamera::ParallelLensCamera(const CameraDescription& description, int width, int height,
                                       int scale_exponent)
    : window(description, width, height, scale_exponent),
      lens(lens_scale(CameraFrame(description, width, height), description, scale_exponent)) {}

}  // namespace lightmill
