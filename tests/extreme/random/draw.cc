#include "tests/extreme/random/draw.h"

#include <algorithm>
#include <cmath>

namespace lightmill::test {
namespace {

/// A hidden lamp that is drawn large, made brighter and placed in a large scene is no more than a scene may
/// have.
constexpr double kBrightest = 1e38;

Rgb times(const Rgb& c, double f) {
  const auto x = [f](float v) { return static_cast<float>(std::min(v * f, kBrightest)); };
  return {x(c.r), x(c.g), x(c.b)};
}

/// Intensities are per squared length.
void place_light(const Transform& by, double scale, LightDescription* light) {
  if (auto* point = std::get_if<PointLight>(&light->kind)) {
    point->position = transform_point(by, point->position);
    point->intensity = times(point->intensity, scale * scale);
  } else if (auto* spot = std::get_if<SpotLight>(&light->kind)) {
    spot->position = transform_point(by, spot->position);
    spot->direction = normalized(transform_vector(by, spot->direction));
    spot->intensity = times(spot->intensity, scale * scale);
  } else if (auto* distant = std::get_if<DistantLight>(&light->kind)) {
    distant->direction = normalized(transform_vector(by, distant->direction));
  } else if (auto* infinite = std::get_if<InfiniteLight>(&light->kind)) {
    infinite->light_to_world = by * infinite->light_to_world;
  }
}

}  // namespace

double Draw::decades(double lo, double hi) { return std::pow(10, uniform(lo, hi)); }

Vec3d Draw::direction() {
  const double z = uniform(-1, 1), phi = uniform(0, 2 * M_PI), r = std::sqrt(1 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

void brighten(double factor, RandomScene* s) {
  SceneDescription& scene = s->test.scene;
  for (double& x : s->exact) x *= factor;
  for (AreaLightDescription& l : scene.area_lights) l.radiance = times(l.radiance, factor);
  for (MediumDescription& m : scene.media) m.emission = times(m.emission, factor);
  for (LightDescription& l : scene.lights) {
    if (auto* point = std::get_if<PointLight>(&l.kind)) point->intensity = times(point->intensity, factor);
    if (auto* spot = std::get_if<SpotLight>(&l.kind)) spot->intensity = times(spot->intensity, factor);
    if (auto* sun = std::get_if<DistantLight>(&l.kind)) sun->irradiance = times(sun->irradiance, factor);
    if (auto* sky = std::get_if<InfiniteLight>(&l.kind)) sky->radiance = times(sky->radiance, factor);
  }
}

void place(double scale, double degrees, const Vec3d& axis, const Vec3d& by, SceneDescription* scene) {
  const Transform turn = rotation(degrees, axis),
                  all = translation(by) * turn * scaling({scale, scale, scale});
  for (ShapeDescription& s : scene->shapes) s.object_to_world = all * s.object_to_world;
  for (LightDescription& l : scene->lights) place_light(all, scale, &l);
  for (MediumDescription& m : scene->media) {
    m.sigma_a = times(m.sigma_a, 1 / scale);
    m.sigma_s = times(m.sigma_s, 1 / scale);
  }
  // A camera keeps its size.
  Transform& camera = scene->camera.camera_to_world;
  const Vec3d eye = transform_point(all, {camera.m[0][3], camera.m[1][3], camera.m[2][3]});
  camera.m[0][3] = camera.m[1][3] = camera.m[2][3] = 0;
  camera = turn * camera;
  camera.m[0][3] = eye.x, camera.m[1][3] = eye.y, camera.m[2][3] = eye.z;
  if (scene->camera.screen_window) {
    for (double& x : *scene->camera.screen_window) x *= scale;
  }
}

}  // namespace lightmill::test
