#include "tests/support/instanced_scene.h"

#include <algorithm>
#include <numbers>
#include <utility>

#include "common/scene/mesh/tessellate.h"
#include "common/scene/motion.h"

namespace lightmill::test {

std::shared_ptr<const TriangleMesh> ball_mesh(double radius, int segments) {
  return std::make_shared<const TriangleMesh>(
      sphere_mesh(radius, -radius, radius, 2 * std::numbers::pi, segments));
}

int begin_object(TestScene* s, const std::string& name) {
  s->scene.objects.push_back({name, {}});
  return static_cast<int>(s->scene.objects.size()) - 1;
}

ShapeDescription& add_to_object(TestScene* s, int object, ShapeKind kind, int material,
                                const Transform& to_object) {
  ShapeDescription& shape = s->scene.objects[static_cast<size_t>(object)].shapes.emplace_back();
  shape.kind = std::move(kind);
  shape.material = material;
  shape.object_to_world = to_object;
  return shape;
}

void instance(TestScene* s, int object, const Transform& to_world) {
  s->scene.instances.push_back({object, -1, to_world});
}

SceneDescription flattened(const SceneDescription& scene) {
  SceneDescription out = scene;
  for (const InstanceDescription& i : scene.instances) {
    for (ShapeDescription shape : scene.objects[static_cast<size_t>(i.object)].shapes) {
      shape.object_to_world = i.object_to_world * shape.object_to_world;
      out.shapes.push_back(std::move(shape));
    }
  }
  out.objects.clear();
  out.instances.clear();
  return out;
}

int ends_at(TestScene* s, const Transform& end) {
  s->scene.later.push_back(end);
  return static_cast<int>(s->scene.later.size()) - 1;
}

std::shared_ptr<const TriangleMesh> bending(const TriangleMesh& mesh, size_t steps,
                                            const std::function<Vec3f(const Vec3f&, double)>& bend) {
  TriangleMesh out = mesh;
  const auto at = [&](double time) {
    MeshStep step{mesh.positions, mesh.normals};
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
      const Vec3f& p = mesh.positions[i];
      const Vec3f q = step.positions[i] = bend(p, time);
      if (mesh.normals.empty()) continue;
      constexpr float kFar = 0.125f;
      const Vec3f& n = mesh.normals[i];
      const Vec3f tip = bend({p.x + kFar * n.x, p.y + kFar * n.y, p.z + kFar * n.z}, time);
      step.normals[i] = {tip.x - q.x, tip.y - q.y, tip.z - q.z};
    }
    return step;
  };
  MeshStep first = at(0);
  out.positions = std::move(first.positions);
  out.normals = std::move(first.normals);
  for (size_t i = 1; i <= steps; ++i)
    out.later.push_back(at(static_cast<double>(i) / static_cast<double>(steps)));
  return std::make_shared<const TriangleMesh>(std::move(out));
}

namespace {

/// A mesh that bends as it is at `time`.
std::shared_ptr<const TriangleMesh> still_mesh(const TriangleMesh& mesh, double time) {
  TriangleMesh out = mesh;
  out.later.clear();
  const double along = time * static_cast<double>(mesh.later.size());
  const size_t step = std::min(static_cast<size_t>(along), mesh.later.size() - 1);
  const auto f = static_cast<float>(along - static_cast<double>(step));
  const auto between = [&](std::vector<Vec3f>* values, const std::vector<Vec3f>& first,
                           std::vector<Vec3f> MeshStep::*of) {
    const std::vector<Vec3f>& a = step == 0 ? first : mesh.later[step - 1].*of;
    const std::vector<Vec3f>& b = mesh.later[step].*of;
    for (size_t i = 0; i < a.size(); ++i) {
      (*values)[i] = {a[i].x + (b[i].x - a[i].x) * f, a[i].y + (b[i].y - a[i].y) * f,
                      a[i].z + (b[i].z - a[i].z) * f};
    }
  };
  between(&out.positions, mesh.positions, &MeshStep::positions);
  between(&out.normals, mesh.normals, &MeshStep::normals);
  return std::make_shared<const TriangleMesh>(std::move(out));
}

/// A point or spot light that moves as it is at `time`.
LightKind still_light(const LightDescription& light, double time) {
  const double along = time * static_cast<double>(light.later.size());
  const size_t step = std::min(static_cast<size_t>(along), light.later.size() - 1);
  const double f = along - static_cast<double>(step);
  LightKind out = step == 0 ? light.kind : light.later[step - 1];
  const LightKind& next = light.later[step];
  const auto between = [&](const Vec3d& a, const Vec3d& b) {
    return Vec3d{a.x + (b.x - a.x) * f, a.y + (b.y - a.y) * f, a.z + (b.z - a.z) * f};
  };
  if (auto* point = std::get_if<PointLight>(&out))
    point->position = between(point->position, std::get<PointLight>(next).position);
  if (auto* spot = std::get_if<SpotLight>(&out)) {
    const auto& to = std::get<SpotLight>(next);
    spot->position = between(spot->position, to.position);
    const Vec3d d = between(spot->direction, to.direction);
    const double n = length(d);
    spot->direction = {d.x / n, d.y / n, d.z / n};
  }
  return out;
}

}  // namespace

SceneDescription still_at(const SceneDescription& scene, double time) {
  SceneDescription out = scene;
  const auto stop = [&](Transform* t, int* moves_to) {
    if (*moves_to >= 0) *t = Way(*t, *moves_to, scene).at(time);
    *moves_to = -1;
  };
  const auto stop_shape = [&](ShapeDescription& s) {
    stop(&s.object_to_world, &s.moves_to);
    auto* mesh = std::get_if<MeshShape>(&s.kind);
    if (mesh && !mesh->mesh->later.empty()) mesh->mesh = still_mesh(*mesh->mesh, time);
  };
  for (ShapeDescription& s : out.shapes) stop_shape(s);
  for (ObjectDescription& o : out.objects) {
    for (ShapeDescription& s : o.shapes) stop_shape(s);
  }
  for (MediumDescription& m : out.media) {
    if (!m.grid || m.grid->moves_to < 0) continue;
    auto grid = std::make_shared<MediumGrid>(*m.grid);
    stop(&grid->medium_to_world, &grid->moves_to);
    m.grid = std::move(grid);
  }
  for (InstanceDescription& i : out.instances) stop(&i.object_to_world, &i.moves_to);
  stop(&out.camera.camera_to_world, &out.camera.moves_to);
  for (LightDescription& l : out.lights) {
    if (!l.later.empty()) l.kind = still_light(l, time);
    l.later.clear();
  }
  out.later.clear();
  out.between.clear();
  return out;
}

TestScene room_of_instances() {
  TestScene s = cornell_room();
  const auto checks = [&](bool spectrum, const Rgb& a, const Rgb& b) {
    s.scene.textures.push_back({"checks", spectrum, CheckerboardTexture{{a, -1}, {b, -1}, {8, 8, 0, 0}}, {}});
    return static_cast<int>(s.scene.textures.size()) - 1;
  };
  const int colors = checks(true, {0.7f, 0.6f, 0.2f}, {0.2f, 0.3f, 0.7f});
  const int holes = checks(false, {1, 1, 1}, {0, 0, 0});
  const int tilts = checks(true, {0.4f, 0.55f, 0.95f}, {0.6f, 0.45f, 0.9f});
  const int painted = s.diffuse(0.5f);
  std::get<DiffuseMaterial>(s.scene.materials.back().kind).reflectance.texture = colors;
  const int bumpy = s.conductor(0.8f, 0.4f);
  s.scene.materials.back().normal_map = tilts;
  const MeshShape ball{ball_mesh(1, 64)};

  // Two shapes, one of them a true sphere: only similarities.
  const int pair = begin_object(&s, "pair");
  add_to_object(&s, pair, ball, painted);
  add_to_object(&s, pair, SphereShape{0.6f}, s.conductor(0.9f, 0.2f), translation({0, 1.5, 0}));
  instance(&s, pair, translation({-0.6, -0.7, 0.2}) * scaling({0.2, 0.2, 0.2}));
  instance(&s, pair, translation({0.6, -0.7, -0.3}) * rotation(40, {1, 2, 3}) * scaling({-0.25, 0.25, 0.25}));
  instance(&s, pair, translation({0.1, 0.2, 0.6}) * rotation(100, {0, 0, 1}) * scaling({0.15, 0.15, 0.15}));

  // Nested transforms, non-uniform scales and a mirror; the shape has its own stretch and orientation.
  const int stretched = begin_object(&s, "stretched");
  add_to_object(&s, stretched, ball, bumpy, rotation(30, {0, 1, 1}) * scaling({100, 60, 40}))
      .reverse_orientation = true;
  const Transform shrink = scaling({0.01, 0.01, 0.01});
  instance(&s, stretched, translation({0, -0.7, 0}) * scaling({0.2, 0.3, 0.2}) * shrink);
  instance(&s, stretched,
           translation({-0.5, 0.2, 0.5}) * rotation(70, {1, 0, 1}) * scaling({0.3, -0.2, 0.2}) * shrink);
  instance(&s, stretched, translation({0.6, 0.1, 0.4}) * scaling({0.2, 0.2, 0.4}) * shrink);

  const int lace = begin_object(&s, "lace");
  add_to_object(&s, lace, ball, painted).alpha.texture = holes;
  for (int i = 0; i < 3; ++i)
    instance(&s, lace,
             translation({0.5 - 0.5 * i, 0.5, 0}) * rotation(60 * i, {1, 1, 0}) * scaling({0.2, 0.2, 0.1}));
  return s;
}

}  // namespace lightmill::test
