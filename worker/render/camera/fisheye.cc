#include "worker/render/camera/fisheye.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "worker/render/camera/camera_frame.h"

namespace lightmill {

FisheyeCamera::FisheyeCamera(const CameraDescription& description, int raster_width, int raster_height) {
  CameraFrame(description, raster_width, raster_height).store_axes(right, down, forward);
  const FisheyeLens& lens = description.fisheye;
  by_sine =
      lens.projection == FisheyeProjection::kEquisolid || lens.projection == FisheyeProjection::kMirrorBall;
  polynomial = lens.projection == FisheyeProjection::kPolynomial;
  half_fov_turns = static_cast<float>(lens.fov_degrees / 720);
  half_width = static_cast<float>(raster_width) / 2;
  half_height = static_cast<float>(raster_height) / 2;
  reach_x = reach_y = largest = 1;
  if (polynomial) set_polynomial(lens);
  if (lens.projection != FisheyeProjection::kEquisolid) return;
  reach_x = static_cast<float>(lens.sensor_width / (4 * lens.focal_length));
  reach_y = static_cast<float>(lens.sensor_height / (4 * lens.focal_length));
  largest = static_cast<float>(std::sin(lens.fov_degrees * M_PI / 720));
}

void FisheyeCamera::set_polynomial(const FisheyeLens& lens) {
  constexpr int kSteps = 4096;
  const auto& c = lens.coefficients;
  const auto angle = [&](double q) { return c[0] + q * (c[1] + q * (c[2] + q * (c[3] + q * c[4]))); };
  const auto slope = [&](double q) { return c[1] + q * (2 * c[2] + q * (3 * c[3] + q * 4 * c[4])); };
  for (size_t i = 0; i < c.size(); ++i) turns_by_power[i] = static_cast<float>(c[i] / (2 * M_PI));
  reach_x = static_cast<float>(lens.sensor_width / 2);
  reach_y = static_cast<float>(lens.sensor_height / 2);
  // The picture ends with the field of view, and where the angle no longer grows.
  const double corner = std::hypot(lens.sensor_width, lens.sensor_height) / 2;
  const double most = std::min(lens.fov_degrees * M_PI / 360, M_PI);
  std::vector<double> angles;
  for (int i = 0; i <= kSteps; ++i) {
    const double q = corner * i / kSteps;
    if (angle(q) > most || !(slope(q) > 0)) break;
    angles.push_back(angle(q));
  }
  const double step = corner / kSteps, last = angles.empty() ? 0 : angles.back();
  largest = static_cast<float>(angles.empty() ? 0 : step * static_cast<double>(angles.size() - 1));
  last_turn = static_cast<float>(last / (2 * M_PI));
  const double first = angles.empty() ? 0 : angles.front();
  // What rounding makes of no angle in the middle is no hole there.
  first_turn = first > 1e-3 ? static_cast<float>(first / (2 * M_PI)) : 0;
  for (int i = 0; i <= kRadii; ++i) {
    const double wanted = last * i / kRadii;
    const auto after = std::upper_bound(angles.begin(), angles.end(), wanted);
    if (after == angles.begin() || after == angles.end()) {
      radii[i] = after == angles.begin() ? 0 : largest;
      continue;
    }
    const double part = (wanted - *(after - 1)) / (*after - *(after - 1));
    radii[i] = static_cast<float>(step * (static_cast<double>(after - 1 - angles.begin()) + part));
  }
}

}  // namespace lightmill
