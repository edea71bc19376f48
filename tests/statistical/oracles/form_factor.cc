#include "tests/statistical/oracles/form_factor.h"

#include <cmath>

namespace lightmill::test {

double polygon_irradiance(const std::vector<Vec3d>& vertices, const Vec3d& x, const Vec3d& n) {
  double sum = 0;
  for (size_t i = 0; i < vertices.size(); ++i) {
    const Vec3d a = normalized(vertices[i] - x), b = normalized(vertices[(i + 1) % vertices.size()] - x);
    const Vec3d c = cross(a, b);
    const double s = length(c);
    if (s > 0) sum += std::atan2(s, dot(a, b)) * dot(c, n) / s;
  }
  return 0.5 * std::fabs(sum);
}

double mean_over_plane(const SceneDescription& scene, double height,
                       const std::function<double(const Vec3d&)>& radiance, int samples) {
  const int nx = scene.film.width * samples, ny = scene.film.height * samples;
  const Vec3d eye = camera_position(scene);
  double sum = 0;
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      const Vec3d d = camera_direction(scene, (i + 0.5) / samples, (j + 0.5) / samples);
      sum += radiance(eye + d * ((height - eye.y) / d.y));
    }
  }
  return sum / (double{1} * nx * ny);
}

}  // namespace lightmill::test
