#include "worker/render/camera/spherical.h"

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
}

void SphericalCamera::wrap(int* x, int* y) const {
  const int w = static_cast<int>(width), h = static_cast<int>(height);
  if (!equal_area) {
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
