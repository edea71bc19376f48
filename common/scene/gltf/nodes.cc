#include "common/scene/gltf/nodes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/scene/gltf/light_groups.h"
#include "common/scene/gltf/view.h"
#include "common/scene/transform.h"

namespace lightmill {

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
    int asset;    // the name of the root above; -1: a root
  };
  std::vector<Open> open;  // explicit: a file may nest as deeply as it likes
  const std::vector<size_t> first = roots();
  for (auto i = first.rbegin(); i != first.rend(); ++i) open.push_back({*i, Transform{}, false, -1});
  while (!open.empty() && !scene_.problems->full()) {
    const auto [index, parent, parent_hidden, asset] = open.back();
    open.pop_back();
    scene_.attempt([&, index = index, &parent = parent, parent_hidden = parent_hidden, asset = asset] {
      const GltfValue node = root_.require("nodes")[index];
      if (seen[index]) node.fail("is reached twice: a node has one parent, and there are no cycles");
      seen[index] = true;
      const Transform to_world = parent * tree_.local(node);
      if (!is_in_range(to_world)) {
        node.mended("lies outside the range of numbers; it and its children are left out");
        return;
      }
      const auto visibility = node.extension("KHR_node_visibility");
      asset_ = asset >= 0 ? asset : name_number(index, node);
      const bool hidden = parent_hidden || (visibility && !visibility->boolean_or("visible", true));
      const int under = asset_;
      if (!visit(index, node, to_world, hidden)) return;
      for (size_t c = node.count("children"); c-- > 0;) {
        const GltfValue child = node.require("children")[c];
        const auto i = static_cast<size_t>(child.integer(0, int64_t{1} << 31));
        if (i >= count)
          child.fail("refers to node " + std::to_string(i) + ", but there are " + std::to_string(count));
        open.push_back({i, to_world, hidden, under});
      }
    });
  }
  place_meshes();
}

int GltfNodes::name_number(size_t index, const GltfValue& node) {
  const std::string name = node.text_or("name", "");
  return scene_.scene.names.number(name.empty() ? "node " + std::to_string(index) : name);
}

bool GltfNodes::visit(size_t index, const GltfValue& node, const Transform& to_world, bool hidden) {
  if (is_singular(to_world)) {
    // Exporters hide things by a scale of 0. What joints carry does not go by it.
    if ((node.find("mesh") || node.find("children")) && !tree_.moves(index) && !node.find("skin"))
      scene_.warning(node.pointer(),
                     "is flattened to nothing by its scale; it and its children are left out");
    if (node.find("skin") && !hidden) scene_.attempt([&] { add_mesh(index, node, to_world); });
    return false;
  }
  scene_.attempt_optional([&] { add_camera(index, node, to_world); });
  if (hidden) return true;  // but for its cameras
  scene_.attempt_optional([&] { add_light(index, node, to_world); });
  scene_.attempt([&] { add_mesh(index, node, to_world); });
  return true;
}

void GltfNodes::add_camera(size_t index, const GltfValue& node, const Transform& to_world) {
  const int camera = node.index_or_none("camera", root_.count("cameras"), "camera");
  if (camera < 0) return;
  const GltfValue value = root_.require("cameras")[static_cast<size_t>(camera)];
  cameras_.push_back({node.text_or("name", ""), value.text_or("name", ""), value, to_world, way_of(index)});
}

void GltfNodes::add_light(size_t index, const GltfValue& node, const Transform& to_world) {
  const auto punctual = node.extension("KHR_lights_punctual");
  if (!punctual) return;
  const auto extension = root_.extension("KHR_lights_punctual");
  const size_t lights = extension ? extension->count("lights") : 0;
  const int light = punctual->index_or_none("light", lights, "light");
  if (light < 0) punctual->fail("needs \"light\"");
  const GltfValue value = extension->require("lights")[static_cast<size_t>(light)];
  const std::vector<Transform> way = way_of(index);
  LightDescription out{gltf_light(value, to_world), scene_.where(value.pointer())};
  const auto of_node = gltf_light_group(node);
  out.light_group = of_node ? *of_node : gltf_light_group(value).value_or("");
  const GltfScene::Quiet quiet(scene_);  // what is wrong with it has been said
  for (size_t i = 0; i < way.size(); ++i) {
    const bool flat = !is_in_range(way[i]) || is_singular(way[i]);
    const LightKind here = flat ? out.kind : gltf_light(value, way[i]);
    if (i == 0) {
      out.kind = here;
    } else {
      out.later.push_back(here);
    }
  }
  scene_.scene.lights.push_back(std::move(out));
}

std::vector<Transform> GltfNodes::way_of(size_t index) {
  if (!tree_.exposure().is_open() || !tree_.moves(index)) return {};
  std::vector<Transform> way = tree_.way(index);
  const bool same =
      std::all_of(way.begin(), way.end(), [&](const Transform& t) { return t.m == way.front().m; });
  if (same) way.resize(1);
  return way;
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

void GltfNodes::add_mesh(size_t index, const GltfValue& node, const Transform& to_world) {
  const int of = node.index_or_none("mesh", root_.count("meshes"), "mesh");
  if (of < 0) return;
  const auto mesh = static_cast<size_t>(of);
  Transform carried;
  const auto bent = bending(index, node, mesh, &carried);
  Group& group = group_of(node, mesh, bent ? &*bent : nullptr);
  group.carried = carried;
  if (group.primitives->empty()) return;
  std::vector<Transform> places = {Transform{}};
  const auto instancing = node.extension("EXT_mesh_gpu_instancing");
  if (instancing) places = instances(*instancing);
  widen_reach(index, mesh, bent ? &*bent : nullptr, group, places);
  const std::vector<Transform> way = way_of(index);
  size_t flat = 0;
  for (const Transform& at : places) {
    Place place{to_world * at, {}, {name_number(index, node), asset_}};
    for (const Transform& t : way) place.way.push_back(t * at);
    if ((is_in_range(place.to_world) && !is_singular(place.to_world)) || (bent && bent->skinned)) {
      group.places.push_back(std::move(place));
    } else {
      ++flat;
    }
  }
  if (flat > 0)
    scene_.warning(node.pointer(), std::to_string(flat) + " instances without extent are left out");
}

}  // namespace lightmill
