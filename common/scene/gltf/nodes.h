#pragma once
// The node hierarchy of a glTF scene: where meshes, lights and cameras are.
#include <deque>
#include <tuple>

#include "common/scene/gltf/animation/node_tree.h"
#include "common/scene/gltf/box.h"
#include "common/scene/gltf/meshes.h"

namespace lightmill {

/// A camera where the scene shows it.
struct GltfPlacedCamera {
  std::string node_name, camera_name;
  GltfValue camera;
  Transform node_to_world;
  std::vector<Transform> way;  // while the shutter is open; empty: there where it is
};

class GltfNodes {
 public:
  GltfNodes(GltfScene& scene, GltfBuffers& buffers, GltfMeshes& meshes, GltfNodeTree& tree,
            const GltfAnimations& animations, const GltfValue& root)
      : scene_(scene),
        buffers_(buffers),
        meshes_(meshes),
        tree_(tree),
        animations_(animations),
        root_(root) {}

  /// Visits the nodes of the file's scene (or all roots if it names none): shapes and lights go to the
  /// description, cameras to cameras().
  void visit_scene();
  const std::vector<GltfPlacedCamera>& cameras() const { return cameras_; }
  /// Around what meshes take up in the course of the animations, for files without a camera: all pictures of
  /// one animation are to show the same part of the world. Else empty.
  const GltfBox& reach() const { return reach_; }

 private:
  struct Place {
    Transform to_world;          // at the picture's time
    std::vector<Transform> way;  // as of way_of
    PartNames names;
  };
  /// A mesh as weights and joints bend it.
  struct Shape {
    size_t number = 0;  // among those of the mesh; 0: at rest
    const std::vector<GltfPrimitive>* primitives = nullptr;
  };
  /// A mesh, its shape's number, and the light group of what emits in it, if that is not of its materials.
  using GroupKey = std::tuple<size_t, size_t, std::optional<std::string>>;
  /// A mesh in one shape and one light group, and where it is.
  struct Group {
    const std::vector<GltfPrimitive>* primitives = nullptr;
    std::vector<Place> places;
    Transform carried;  // of what joints carry, wherever the node is
  };

  std::vector<size_t> roots() const;
  /// False: nothing of the node's children can be seen.
  bool visit(size_t index, const GltfValue& node, const Transform& to_world, bool hidden);
  void add_camera(size_t index, const GltfValue& node, const Transform& to_world);
  void add_light(size_t index, const GltfValue& node, const Transform& to_world);
  void add_mesh(size_t index, const GltfValue& node, const Transform& to_world);
  std::vector<Transform> instances(const GltfValue& instancing);
  void widen_reach(size_t index, size_t mesh, const GltfBending* bending, const Group& group,
                   const std::vector<Transform>& places);
  /// The node's way while the shutter is open: several places, or one where it stands then; empty if nothing
  /// ever moves it.
  std::vector<Transform> way_of(size_t index);
  /// How node `index` bends its mesh; nothing if it does not.
  std::optional<GltfBending> bending(size_t index, const GltfValue& node, size_t mesh, Transform* carried);
  std::optional<GltfSkin> skin_of(const GltfValue& node);
  Shape shape_of(size_t mesh, const GltfBending* bending);
  /// The group of a node's mesh in that shape.
  Group& group_of(const GltfValue& node, size_t mesh, const GltfBending* bending);
  /// The area light `index` in a light group.
  int in_light_group(int index, const std::string& name);
  /// A node's name, or its number.
  int name_number(size_t index, const GltfValue& node);
  /// Meshes that are seen once become shapes, others objects with instances.
  void place_meshes();
  void place_once(const Group& group, std::vector<ShapeDescription> shapes);
  /// What a thing that moves along `way` has as its beginning and its moves_to; it may have to stand.
  void set_way(const Place& place, const SourceLocation& where, Transform* begin, int* moves_to);

  GltfScene& scene_;
  GltfBuffers& buffers_;
  GltfMeshes& meshes_;
  GltfNodeTree& tree_;
  const GltfAnimations& animations_;
  GltfValue root_;
  std::vector<GltfPlacedCamera> cameras_;
  std::map<GroupKey, Group> groups_;
  std::map<size_t, size_t> shapes_of_mesh_;                       // how many, beside that at rest
  std::map<std::pair<size_t, std::vector<double>>, Shape> bent_;  // by mesh and weights
  std::map<std::pair<int, std::string>, int> regrouped_;          // by area light and light group
  GltfBox reach_;
  int asset_ = -1;  // of the node that is visited: the name of its root, in the scene's names
  std::deque<std::vector<GltfPrimitive>> own_;  // of meshes that are bent
};

}  // namespace lightmill
