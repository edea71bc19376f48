#include "tests/support/scaled_scene.h"

#include <cmath>
#include <set>

namespace lightmill::test {

SceneDescription scaled_scene(const SceneDescription& scene, int k) {
  SceneDescription out = scene;
  const double length = std::ldexp(1.0, k);
  for (ShapeDescription& s : out.shapes) {
    for (size_t i = 0; i < 3; ++i) {
      for (double& x : s.object_to_world.m[i]) x *= length;
    }
  }
  for (InstanceDescription& instance : out.instances) {
    for (size_t i = 0; i < 3; ++i) {
      for (double& x : instance.object_to_world.m[i]) x *= length;
    }
  }
  // Of what moves in the world; shapes in objects stay as they are.
  std::set<int> ends;
  for (const ShapeDescription& shape : out.shapes) ends.insert(shape.moves_to);
  for (const InstanceDescription& instance : out.instances) ends.insert(instance.moves_to);
  for (const int end : ends) {
    for (size_t i = 0; end >= 0 && i < 3; ++i) {
      for (double& x : out.later[static_cast<size_t>(end)].m[i]) x *= length;
    }
  }
  if (out.camera.moves_to >= 0) {
    Transform& end = out.later[static_cast<size_t>(out.camera.moves_to)];
    for (size_t i = 0; i < 3; ++i) end.m[i][3] *= length;
  }
  const auto scale_point = [&](auto& light) {
    const float f = std::ldexp(1.0f, 2 * k);
    light.position = light.position * length;
    light.intensity = {light.intensity.r * f, light.intensity.g * f, light.intensity.b * f};
  };
  for (LightDescription& l : out.lights) {
    if (auto* point = std::get_if<PointLight>(&l.kind)) scale_point(*point);
    if (auto* spot = std::get_if<SpotLight>(&l.kind)) scale_point(*spot);
    const auto scale_image = [&](auto& light) {
      const float f = std::ldexp(1.0f, 2 * k);
      for (size_t i = 0; i < 3; ++i) light.light_to_world.m[i][3] *= length;
      light.intensity = {light.intensity.r * f, light.intensity.g * f, light.intensity.b * f};
    };
    if (auto* light = std::get_if<GoniometricLight>(&l.kind)) scale_image(*light);
    if (auto* light = std::get_if<ProjectionLight>(&l.kind)) scale_image(*light);
  }
  for (MediumDescription& m : out.media) {
    const float f = std::ldexp(1.0f, -k);
    m.sigma_a = {m.sigma_a.r * f, m.sigma_a.g * f, m.sigma_a.b * f};
    m.sigma_s = {m.sigma_s.r * f, m.sigma_s.g * f, m.sigma_s.b * f};
    if (!m.grid) continue;
    auto grid = std::make_shared<MediumGrid>(*m.grid);
    for (size_t row = 0; row < 3; ++row) {
      for (double& x : grid->medium_to_world.m[row]) x *= length;
    }
    m.grid = std::move(grid);
  }
  for (MaterialDescription& m : out.materials) {
    auto* body = std::get_if<SubsurfaceMaterial>(&m.kind);
    if (!body) continue;
    const float f = std::ldexp(1.0f, -k), free = std::ldexp(1.0f, k);
    body->sigma_a = {body->sigma_a.r * f, body->sigma_a.g * f, body->sigma_a.b * f};
    body->sigma_s = {body->sigma_s.r * f, body->sigma_s.g * f, body->sigma_s.b * f};
    body->mfp = {body->mfp.r * free, body->mfp.g * free, body->mfp.b * free};
  }
  CameraDescription& c = out.camera;
  for (size_t i = 0; i < 3; ++i) c.camera_to_world.m[i][3] *= length;
  c.lens_radius *= length;
  c.focal_distance *= length;
  if (c.kind == CameraKind::kOrthographic) {
    if (!c.screen_window) c.screen_window = std::array<double, 4>{-1, 1, -1, 1};
    for (double& x : *c.screen_window) x *= length;
  }
  return out;
}

SceneDescription scaled_vertices(const SceneDescription& scene, int k) {
  SceneDescription out = scaled_scene(scene, k);
  const auto scale = [&](const ShapeDescription& from, ShapeDescription* to) {
    const auto* mesh = std::get_if<MeshShape>(&from.kind);
    if (!mesh) return;
    to->object_to_world = from.object_to_world;
    TriangleMesh copy = *mesh->mesh;
    for (Vec3f& v : copy.positions) v = {std::ldexp(v.x, k), std::ldexp(v.y, k), std::ldexp(v.z, k)};
    to->kind = MeshShape{std::make_shared<TriangleMesh>(std::move(copy))};
  };
  for (size_t i = 0; i < out.shapes.size(); ++i) scale(scene.shapes[i], &out.shapes[i]);
  const double length = std::ldexp(1.0, k);
  for (size_t i = 0; i < out.objects.size(); ++i) {
    for (size_t j = 0; j < out.objects[i].shapes.size(); ++j) {
      ShapeDescription& shape = out.objects[i].shapes[j];
      for (size_t row = 0; row < 3; ++row) {
        for (double& x : shape.object_to_world.m[row]) x *= length;
      }
      scale(scene.objects[i].shapes[j], &shape);
    }
  }
  for (size_t i = 0; i < out.instances.size(); ++i) {
    Transform& t = out.instances[i].object_to_world = scene.instances[i].object_to_world;
    for (size_t row = 0; row < 3; ++row) t.m[row][3] *= length;
  }
  return out;
}

TestScene scene_of_everything(const std::string& environment) {
  TestScene s;
  const int white = s.diffuse(0.7f);
  s.quad({-1, -1, -1}, {0, 0, 2}, {2, 0, 0}, white);                               // floor
  s.quad({-1, -1, 1}, {0, 2, 0}, {2, 0, 0}, white);                                // back
  s.quad({-1, -1, -1}, {0, 2, 0}, {0, 0, 2}, s.diffuse(Rgb{0.6f, 0.05f, 0.05f}));  // left
  s.quad({0.99, -1, -0.5}, {0, 0, 1.2}, {0, 1.5, 0},
         s.diffuse_transmission({0.3f, 0.2f, 0.1f}, {0.2f, 0.4f, 0.2f}));
  s.sphere({-0.5, -0.6, 0.4}, 0.3, s.dielectric(1.5f, 0));
  s.sphere({0.1, -0.75, 0.2}, 0.2, s.dielectric(1.4f, 0.3f));
  s.sphere({0.35, -0.2, 0.5}, 0.2, s.conductor(0.9f, 0.2f));
  s.sphere({-0.4, 0.3, 0.8}, 0.15, s.coated({0.2f, 0.3f, 0.8f}, 1.5f, 0));
  s.sphere({0, 0.5, 0.8}, 0.15, s.coated({0.8f, 0.3f, 0.2f}, 1.5f, 0.2f));
  s.quad({-0.9, -0.9, 0.9}, {0, 0.8, 0.05}, {0.8, 0, 0}, s.conductor(0.8f, 0));
  s.quad({0.2, -0.9, 0.1}, {0, 0.5, 0}, {0.3, 0, 0.1}, s.thin_dielectric(1.5f));
  const int black = s.diffuse(0);
  s.quad({-0.3, 0.98, 0.0}, {0.6, 0, 0}, {0, 0, 0.6}, black, {.radiance = {8, 7, 6}});
  s.sphere({0.7, 0.6, 0.6}, 0.05, black, {.radiance = {20, 10, 5}});
  s.point_light({-0.6, 0.5, -0.3}, {0.2f, 0.3f, 0.4f});
  s.scene.lights.push_back(
      {SpotLight{{0.5f, 0.5f, 0.2f}, {0.6, 0.8, -0.5}, normalized({-0.5, -1, 0.6}), 15, 30}, {}});
  s.scene.lights.push_back({DistantLight{{0.5f, 0.5f, 0.6f}, normalized({0.3, -1, 0.4})}, {}});
  s.scene.lights.push_back({InfiniteLight{{0.2f, 0.3f, 0.4f}, environment, {}}, {}});
  if (!environment.empty()) {
    Transform at;
    at.m = {{{1, 0, 0, 0.4}, {0, 1, 0, 0.3}, {0, 0, 1, -0.4}, {0, 0, 0, 1}}};
    s.scene.lights.push_back({GoniometricLight{{0.05f, 0.05f, 0.02f}, environment, at, 0}, {}});
    s.scene.lights.push_back({ProjectionLight{{0.1f, 0.1f, 0.2f}, environment, at, 40, 0}, {}});
  }
  CheckerboardTexture board{{{1, 1, 0.5f}, -1}, {{0.2f, 0.5f, 1}, -1}, {6, 4, 0, 0}};
  s.scene.textures.push_back({"board", true, board, {}});
  s.scene.area_lights.back().texture = static_cast<int>(s.scene.textures.size()) - 1;
  s.camera({0, 0, -0.9}, {0, 0, 1}, 75).film(32, 32);
  return s;
}

}  // namespace lightmill::test
