// Meshes of nodes as shapes and instances of the scene.
#include <algorithm>

#include "common/scene/gltf/light_groups.h"
#include "common/scene/gltf/nodes.h"
#include "common/scene/motion.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

/// Whether a thing can go this way: it is flat nowhere, nor turned inside out.
bool is_passable(const std::vector<Transform>& way) {
  for (const Transform& t : way) {
    if (!is_in_range(t) || is_singular(t) || !can_move(way.front(), t)) return false;
  }
  return true;
}

bool emits(const GltfPrimitive& primitive) { return primitive.surface.area_light >= 0; }

}  // namespace

GltfNodes::Shape GltfNodes::shape_of(size_t mesh, const GltfBending* bending) {
  if (bending == nullptr) return {0, &meshes_.primitives(mesh)};
  const bool rests = !bending->skinned && !bending->moves;
  if (rests) {
    const auto known = bent_.find({mesh, bending->still.weights});
    if (known != bent_.end()) return known->second;
  }
  own_.push_back(meshes_.bent(mesh, *bending));
  const Shape shape{++shapes_of_mesh_[mesh], &own_.back()};
  if (rests) bent_[{mesh, bending->still.weights}] = shape;
  return shape;
}

GltfNodes::Group& GltfNodes::group_of(const GltfValue& node, size_t mesh, const GltfBending* bending) {
  const Shape shape = shape_of(mesh, bending);
  std::optional<std::string> light_group;
  if (std::any_of(shape.primitives->begin(), shape.primitives->end(), emits))
    light_group = gltf_light_group(node);
  Group& group = groups_[{mesh, shape.number, light_group}];
  group.primitives = shape.primitives;
  return group;
}

int GltfNodes::in_light_group(int index, const std::string& name) {
  auto& lights = scene_.scene.area_lights;
  AreaLightDescription light = lights.at(static_cast<size_t>(index));
  if (light.light_group == name) return index;
  const auto [entry, is_new] = regrouped_.try_emplace({index, name}, static_cast<int>(lights.size()));
  if (is_new) {
    light.light_group = name;
    lights.push_back(std::move(light));
  }
  return entry->second;
}

void GltfNodes::widen_reach(size_t index, size_t mesh, const GltfBending* bending, const Group& group,
                            const std::vector<Transform>& places) {
  if (animations_.empty() || root_.count("cameras") > 0) return;
  constexpr int kTimes = 16;
  const auto [first, last] = animations_.span();
  const GltfScene::Quiet quiet(scene_);  // what is wrong has been said
  for (int i = 0; i <= kTimes; ++i) {
    const double time = first + (last - first) * i / kTimes;
    std::vector<GltfPrimitive> bent;
    if (bending != nullptr) bent = meshes_.bent(mesh, bending->still_at(time));
    const Transform to_world = tree_.to_world(index, time);
    for (const GltfPrimitive& p : bending != nullptr ? bent : *group.primitives) {
      GltfBox box;
      for (const Vec3f& v : p.mesh->positions) box.add({double{v.x}, double{v.y}, double{v.z}});
      for (const Transform& place : places) {
        for (int corner = 0; !box.empty() && corner < 8; ++corner)
          reach_.add(transform_point(p.skinned ? group.carried : to_world * place, box.corner(corner)));
      }
    }
    if (bending == nullptr && !tree_.moves(index)) return;
  }
}

void GltfNodes::set_way(const Place& place, const SourceLocation& where, Transform* begin, int* moves_to) {
  *begin = place.to_world;
  *moves_to = -1;
  if (place.way.empty()) return;
  if (!is_passable(place.way)) {
    scene_.problems->warning(where,
                             "a mesh is flattened or turned inside out while the shutter is open; it "
                             "stands still");
    return;
  }
  *begin = place.way.front();
  if (place.way.size() == 1) return;
  SceneDescription& scene = scene_.scene;
  *moves_to = static_cast<int>(scene.later.size());
  scene.later.push_back(place.way.back());
  if (place.way.size() > 2)
    scene.between[*moves_to] = std::vector<Transform>(place.way.begin() + 1, place.way.end() - 1);
}

void GltfNodes::place_once(const Group& group, std::vector<ShapeDescription> shapes) {
  const Place& place = group.places.front();
  Transform begin;
  int moves_to = -1;
  const bool carried_all = std::all_of(group.primitives->begin(), group.primitives->end(),
                                       [](const GltfPrimitive& p) { return p.skinned; });
  if (!carried_all) set_way(place, shapes.front().location, &begin, &moves_to);
  for (size_t i = 0; i < shapes.size(); ++i) {
    ShapeDescription& s = shapes[i];
    s.names = place.names;
    if ((*group.primitives)[i].skinned) {
      s.object_to_world = group.carried;
    } else {
      if (is_singular(place.to_world)) continue;
      s.object_to_world = begin;
      s.moves_to = moves_to;
    }
    scene_.scene.shapes.push_back(std::move(s));
  }
}

void GltfNodes::place_meshes() {
  for (const auto& [key, group] : groups_) {
    if (group.places.empty()) continue;
    const auto& [mesh, number, light_group] = key;
    std::vector<ShapeDescription> shapes;
    for (const GltfPrimitive& p : *group.primitives) {
      ShapeDescription shape;
      shape.kind = MeshShape{p.mesh};
      shape.material = p.surface.material;
      shape.area_light = p.surface.area_light;
      if (emits(p) && light_group) shape.area_light = in_light_group(shape.area_light, *light_group);
      shape.alpha = p.surface.alpha;
      shape.media = p.surface.media;
      shape.location = p.location;
      shapes.push_back(std::move(shape));
    }
    if (group.places.size() == 1) {
      place_once(group, std::move(shapes));
      continue;
    }
    SceneDescription& scene = scene_.scene;
    const auto object = static_cast<int>(scene.objects.size());
    scene.objects.push_back({"mesh " + std::to_string(mesh), std::move(shapes)});
    for (const Place& place : group.places) {
      InstanceDescription instance;
      instance.object = object;
      instance.names = place.names;
      set_way(place, {scene_.name, 1, 1}, &instance.object_to_world, &instance.moves_to);
      scene.instances.push_back(instance);
    }
  }
}

}  // namespace lightmill
