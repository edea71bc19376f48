#include "worker/render/camera/spherical.h"

#include <cmath>

#include "worker/render/camera/camera_frame.h"

namespace lightmill {

SphericalCamera::SphericalCamera(const CameraDescription& description, int raster_width, int raster_height) {
  const CameraFrame frame(description, raster_width, raster_height);
  float down[3];
  frame.store_axes(right, down, forward);
  for (size_t i = 0; i < 3; ++i) up[i] = -down[i];
  equal_area = description.mapping == SphericalMapping::kEqualArea;
  width = static_cast<float>(raster_width);
  height = static_cast<float>(raster_height);
  inv_width = 1 / width;
  inv_height = 1 / height;
  if (!description.range) return;
  const PanoramaRange& range = *description.range;
  const double wide = (range.longitude_max - range.longitude_min) / 360,
               high = (range.latitude_max - range.latitude_min) / 180;
  ranged = true;
  s_from = static_cast<float>(0.25 - range.longitude_min / 360);
  s_step = static_cast<float>(-wide);
  t_from = static_cast<float>(0.5 - range.latitude_max / 180);
  t_step = static_cast<float>(high);
  round_x = std::fabs(wide - 1) < 1e-6;
  round_y = round_x && std::fabs(high - 1) < 1e-6;
}

void SphericalCamera::wrap(int* x, int* y) const {
  const int w = static_cast<int>(width), h = static_cast<int>(height);
  if (!equal_area) {
    if (!round_y) {
      *x = (*x % w + w) % w;
      return;
    }
    *y = (*y % (2 * h) + 2 * h) % (2 * h);  // the meridian's full circle
    if (*y >= h) {
      *y = 2 * h - 1 - *y;
      *x += w / 2;
    }
    *x = (*x % w + w) % w;
    return;
  }
  while (*x < 0 || *x >= w || *y < 0 || *y >= h) {
    if (*x < 0 || *x >= w) {
      *x = *x < 0 ? -1 - *x : 2 * w - 1 - *x;
      *y = h - 1 - *y;
    }
    if (*y < 0 || *y >= h) {
      *y = *y < 0 ? -1 - *y : 2 * h - 1 - *y;
      *x = w - 1 - *x;
    }
  }
}

}  // namespace lightmill
