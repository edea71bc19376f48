#include "worker/render/camera/fisheye.h"

#include <cmath>

#include "worker/render/camera/camera_frame.h"

namespace lightmill {

FisheyeCamera::FisheyeCamera(const CameraDescription& description, int raster_width, int raster_height) {
  CameraFrame(description, raster_width, raster_height).store_axes(right, down, forward);
  const FisheyeLens& lens = description.fisheye;
  by_sine = lens.projection != FisheyeProjection::kEquidistant;
  half_fov_turns = static_cast<float>(lens.fov_degrees / 720);
  half_width = static_cast<float>(raster_width) / 2;
  half_height = static_cast<float>(raster_height) / 2;
  reach_x = reach_y = largest = 1;
  if (lens.projection != FisheyeProjection::kEquisolid) return;
  reach_x = static_cast<float>(lens.sensor_width / (4 * lens.focal_length));
  reach_y = static_cast<float>(lens.sensor_height / (4 * lens.focal_length));
  largest = static_cast<float>(std::sin(lens.fov_degrees * M_PI / 720));
}

}  // namespace lightmill
