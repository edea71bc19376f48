#include "common/scene/gltf/nodes.h"

#include <cmath>

#include "common/scene/gltf/view.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

/// From a quaternion (x, y, z, w) of any length; false if it has none.
bool rotation_of(const double* q, Transform* out) {
  const double n = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  if (!(n > 1e-30) || !std::isfinite(n)) return false;
  const double s = 2 / n, x = q[0], y = q[1], z = q[2], w = q[3];
  *out = Transform{};
  out->m[0] = {1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w), 0};
  out->m[1] = {s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w), 0};
  out->m[2] = {s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y), 0};
  return true;
}

/// The same; what is no rotation, or of a length other than 1, is mended at `where`.
Transform rotation_at(const GltfValue& where, const double* q) {
  constexpr double kSlack = 0.01;
  Transform rotation;
  if (!rotation_of(q, &rotation)) {
    where.mended("is no rotation: all four are 0; it does not turn");
    return Transform{};
  }
  const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (std::abs(n - 1) > kSlack) where.mended("is a quaternion of a length that is not 1; it is normalised");
  return rotation;
}

Transform local_transform(const GltfValue& node) {
  if (node.find("matrix")) {
    const auto m = node.numbers_or("matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, -kLargestEntry,
                                   kLargestEntry);
    std::array<double, 16> columns;
    std::copy(m.begin(), m.end(), columns.begin());
    const Transform t = from_columns(columns);
    if (is_affine(t)) return t;
    node.require("matrix").mended("must have 0 0 0 1 as its last row; it gets that");
    Transform affine = t;
    affine.m[3] = {0, 0, 0, 1};
    return affine;
  }
  const auto t = node.numbers_or("translation", {0, 0, 0}, -kLargestEntry, kLargestEntry);
  const auto r = node.numbers_or("rotation", {0, 0, 0, 1}, -1e6, 1e6);
  const auto s = node.numbers_or("scale", {1, 1, 1}, -kLargestEntry, kLargestEntry);
  const auto given = node.find("rotation");
  const Transform rotation = given ? rotation_at(*given, r.data()) : Transform{};
  return translation({t[0], t[1], t[2]}) * rotation * scaling({s[0], s[1], s[2]});
}

}  // namespace

std::vector<size_t> GltfNodes::roots() const {
  const size_t nodes = root_.count("nodes"), scenes = root_.count("scenes");
  std::vector<size_t> out;
  if (scenes > 0) {
    const int chosen = root_.index_or_none("scene", scenes, "scene");
    const GltfValue scene = root_.require("scenes")[static_cast<size_t>(std::max(chosen, 0))];
    for (size_t i = 0; i < scene.count("nodes"); ++i) {
      const GltfValue index = scene.require("nodes")[i];
      const auto node = static_cast<size_t>(index.integer(0, int64_t{1} << 31));
      if (node >= nodes)
        index.fail("refers to node " + std::to_string(node) + ", but there are " + std::to_string(nodes));
      out.push_back(node);
    }
    return out;
  }
  std::vector<bool> is_child(nodes, false);
  for (size_t i = 0; i < nodes; ++i) {
    const GltfValue node = root_.require("nodes")[i];
    for (size_t c = 0; c < node.count("children"); ++c) {
      const auto child = static_cast<size_t>(node.require("children")[c].integer(0, int64_t{1} << 31));
      if (child < nodes) is_child[child] = true;
    }
  }
  for (size_t i = 0; i < nodes; ++i) {
    if (!is_child[i]) out.push_back(i);
  }
  return out;
}

void GltfNodes::visit_scene() {
  const size_t count = root_.count("nodes");
  std::vector<bool> seen(count, false);
  struct Open {
    size_t index;
    Transform parent;
    bool hidden;  // KHR_node_visibility, which hides what is below, too
  };
  std::vector<Open> open;  // explicit: a file may nest as deeply as it likes
  const std::vector<size_t> first = roots();
  for (auto i = first.rbegin(); i != first.rend(); ++i) open.push_back({*i, Transform{}, false});
  while (!open.empty() && !scene_.problems->full()) {
    const auto [index, parent, parent_hidden] = open.back();
    open.pop_back();
    scene_.attempt([&, index = index, &parent = parent, parent_hidden = parent_hidden] {
      const GltfValue node = root_.require("nodes")[index];
      if (seen[index]) node.fail("is reached twice: a node has one parent, and there are no cycles");
      seen[index] = true;
      const Transform to_world = parent * local_transform(node);
      if (!is_in_range(to_world)) {
        node.mended("lies outside the range of numbers; it and its children are left out");
        return;
      }
      const auto visibility = node.extension("KHR_node_visibility");
      const bool hidden = parent_hidden || (visibility && !visibility->boolean_or("visible", true));
      if (!visit(node, to_world, hidden)) return;
      for (size_t c = node.count("children"); c-- > 0;) {
        const GltfValue child = node.require("children")[c];
        const auto i = static_cast<size_t>(child.integer(0, int64_t{1} << 31));
        if (i >= count)
          child.fail("refers to node " + std::to_string(i) + ", but there are " + std::to_string(count));
        open.push_back({i, to_world, hidden});
      }
    });
  }
  place_meshes();
}

bool GltfNodes::visit(const GltfValue& node, const Transform& to_world, bool hidden) {
  if (is_singular(to_world)) {
    // Exporters hide things by a scale of 0.
    if (node.find("mesh") || node.find("children"))
      scene_.warning(node.pointer(),
                     "is flattened to nothing by its scale; it and its children are left out");
    return false;
  }
  scene_.attempt_optional([&] {
    const int camera = node.index_or_none("camera", root_.count("cameras"), "camera");
    if (camera < 0) return;
    const GltfValue value = root_.require("cameras")[static_cast<size_t>(camera)];
    cameras_.push_back({node.text_or("name", ""), value.text_or("name", ""), value, to_world});
  });
  if (hidden) return true;  // but for its cameras
  if (const auto punctual = node.extension("KHR_lights_punctual")) {
    scene_.attempt_optional([&] {
      const auto extension = root_.extension("KHR_lights_punctual");
      const size_t lights = extension ? extension->count("lights") : 0;
      const int light = punctual->index_or_none("light", lights, "light");
      if (light < 0) punctual->fail("needs \"light\"");
      const GltfValue value = extension->require("lights")[static_cast<size_t>(light)];
      scene_.scene.lights.push_back({gltf_light(value, to_world), scene_.where(value.pointer())});
    });
  }
  if (node.find("skin"))
    scene_.unsupported(node.pointer(), "skins; the mesh is in the pose in which it was modelled");
  scene_.attempt([&] { add_mesh(node, to_world); });
  return true;
}

std::vector<Transform> GltfNodes::instances(const GltfValue& instancing) {
  const GltfValue attributes = instancing.require("attributes");
  const size_t accessors = root_.count("accessors");
  std::optional<GltfAccessor> t, r, s;
  size_t count = 0;
  const auto open = [&](const char* key, int components) -> std::optional<GltfAccessor> {
    const int of = attributes.index_or_none(key, accessors, "accessor");
    if (of < 0) return std::nullopt;
    GltfAccessor a = buffers_.accessor(static_cast<size_t>(of), {components});
    if (count > 0 && a.count() != count) attributes.fail("have different counts");
    count = a.count();
    return a;
  };
  t = open("TRANSLATION", 3);
  r = open("ROTATION", 4);
  s = open("SCALE", 3);
  if (count == 0) attributes.fail("needs one of TRANSLATION, ROTATION and SCALE");
  buffers_.charge(16 * count, attributes);
  std::vector<Transform> out(count);
  const GltfValue rotations = r ? attributes.require("ROTATION") : attributes;
  for (size_t i = 0; i < count; ++i) {
    float x[4];
    const auto vec = [&] { return Vec3d{x[0], x[1], x[2]}; };
    if (t) {
      t->read(i, x);
      out[i] = translation(vec());
    }
    if (r) {
      r->read(i, x);
      const double q[4] = {x[0], x[1], x[2], x[3]};
      out[i] = out[i] * rotation_at(rotations, q);
    }
    if (s) {
      s->read(i, x);
      out[i] = out[i] * scaling(vec());
    }
  }
  return out;
}

void GltfNodes::add_mesh(const GltfValue& node, const Transform& to_world) {
  const int index = node.index_or_none("mesh", root_.count("meshes"), "mesh");
  if (index < 0) return;
  if (meshes_.primitives(static_cast<size_t>(index)).empty()) return;
  std::vector<Transform> places = {Transform{}};
  const auto instancing = node.extension("EXT_mesh_gpu_instancing");
  if (instancing) places = instances(*instancing);
  size_t flat = 0;
  for (const Transform& place : places) {
    const Transform object_to_world = to_world * place;
    if (is_in_range(object_to_world) && !is_singular(object_to_world)) {
      places_[static_cast<size_t>(index)].push_back(object_to_world);
    } else {
      ++flat;
    }
  }
  if (flat > 0)
    scene_.warning(node.pointer(), std::to_string(flat) + " instances without extent are left out");
}

void GltfNodes::place_meshes() {
  for (const auto& [mesh, places] : places_) {
    std::vector<ShapeDescription> shapes;
    for (const GltfPrimitive& p : meshes_.primitives(mesh)) {
      ShapeDescription shape;
      shape.kind = MeshShape{p.mesh};
      shape.material = p.surface.material;
      shape.area_light = p.surface.area_light;
      shape.alpha = p.surface.alpha;
      shape.media = p.surface.media;
      shape.location = p.location;
      shapes.push_back(std::move(shape));
    }
    SceneDescription& scene = scene_.scene;
    if (places.size() == 1) {
      for (ShapeDescription& s : shapes) {
        s.object_to_world = places.front();
        scene.shapes.push_back(std::move(s));
      }
      continue;
    }
    const auto object = static_cast<int>(scene.objects.size());
    scene.objects.push_back({"mesh " + std::to_string(mesh), std::move(shapes)});
    for (const Transform& place : places) scene.instances.push_back({object, -1, place});
  }
}

}  // namespace lightmill
