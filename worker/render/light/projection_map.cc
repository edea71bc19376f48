#include "worker/render/light/projection_map.h"

#include <algorithm>
#include <cmath>

#include "common/base/error.h"
#include "worker/render/light/alias_table.h"

namespace lightmill {

ProjectionMap::ProjectionMap(LightImage image, const Rgb& scale, const Transform& light_to_world,
                             double fov_degrees)
    : width(image.width), height(image.height), rgb(std::move(image.rgb)) {
  light_axes(light_to_world, image.path, to_light);
  const double tangent = std::tan(fov_degrees * M_PI / 360), w = width, h = height;
  const double window_x = tangent * std::max(w / h, 1.0), window_y = tangent * std::max(h / w, 1.0);
  half_x = static_cast<float>(window_x);
  half_y = static_cast<float>(window_y);
  const double texel_area = 4 * window_x * window_y / (w * h);
  const float factor[3] = {scale.r, scale.g, scale.b};
  std::vector<double> weights(rgb.size() / 3);
  for (size_t i = 0; i < weights.size(); ++i) {
    // A texel's solid angle by its centre, as pbrt has it: area x cos^3.
    const size_t column = i % static_cast<size_t>(width), row = i / static_cast<size_t>(width);
    const double x = ((static_cast<double>(column) + 0.5) / w * 2 - 1) * window_x;
    const double y = ((static_cast<double>(row) + 0.5) / h * 2 - 1) * window_y;
    const double d2 = 1 + x * x + y * y, solid_angle = texel_area / (d2 * std::sqrt(d2));
    for (size_t c = 0; c < 3; ++c) {
      float& value = rgb[3 * i + c];
      value *= factor[c];
      if (!std::isfinite(value)) {
        throw Error(ErrorKind::kBadScene,
                    image.path + ": the light is brighter than float can hold; lower its \"scale\"");
      }
      brightest = std::max(brightest, value);
      weights[i] += value / 3.0 * solid_angle;
    }
    power += weights[i];
  }
  if (!(brightest > 0))
    throw Error(ErrorKind::kBadScene, image.path + ": the light's image is black; leave the light out");
  const std::vector<double> probability = build_alias_table(weights, &alias_keep, &alias);
  density.resize(weights.size());
  for (size_t i = 0; i < weights.size(); ++i) density[i] = static_cast<float>(probability[i] / texel_area);
}

}  // namespace lightmill
