#pragma once
// The node hierarchy of a glTF scene: where meshes, lights and cameras are.
#include "common/scene/gltf/meshes.h"

namespace lightmill {

/// A camera where the scene shows it.
struct GltfPlacedCamera {
  std::string node_name, camera_name;
  GltfValue camera;
  Transform node_to_world;
};

class GltfNodes {
 public:
  GltfNodes(GltfScene& scene, GltfBuffers& buffers, GltfMeshes& meshes, const GltfValue& root)
      : scene_(scene), buffers_(buffers), meshes_(meshes), root_(root) {}

  /// Visits the nodes of the file's scene (or all roots if it names none): shapes and lights go to the
  /// description, cameras to cameras().
  void visit_scene();
  const std::vector<GltfPlacedCamera>& cameras() const { return cameras_; }

 private:
  std::vector<size_t> roots() const;
  /// False: nothing of the node can be seen.
  bool visit(const GltfValue& node, const Transform& to_world, bool hidden);
  void add_mesh(const GltfValue& node, const Transform& to_world);
  /// Meshes that are seen once become shapes, others objects with instances.
  void place_meshes();
  std::vector<Transform> instances(const GltfValue& instancing);

  GltfScene& scene_;
  GltfBuffers& buffers_;
  GltfMeshes& meshes_;
  GltfValue root_;
  std::vector<GltfPlacedCamera> cameras_;
  std::map<size_t, std::vector<Transform>> places_;  // by mesh
};

}  // namespace lightmill
