#include "tests/support/instanced_scene.h"

#include <numbers>

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

SceneDescription still_at(const SceneDescription& scene, double time) {
  SceneDescription out = scene;
  const auto stop = [&](Transform* t, int* moves_to) {
    if (*moves_to >= 0) *t = Motion(*t, scene.later[static_cast<size_t>(*moves_to)]).at(time);
    *moves_to = -1;
  };
  for (ShapeDescription& s : out.shapes) stop(&s.object_to_world, &s.moves_to);
  for (ObjectDescription& o : out.objects) {
    for (ShapeDescription& s : o.shapes) stop(&s.object_to_world, &s.moves_to);
  }
  for (InstanceDescription& i : out.instances) stop(&i.object_to_world, &i.moves_to);
  stop(&out.camera.camera_to_world, &out.camera.moves_to);
  out.later.clear();
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
