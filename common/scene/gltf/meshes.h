#pragma once
// glTF primitives as triangle meshes.
#include "common/scene/gltf/animation/deformation.h"
#include "common/scene/gltf/materials.h"

namespace lightmill {

/// One primitive of a mesh, shared by the nodes that show it.
struct GltfPrimitive {
  std::shared_ptr<const TriangleMesh> mesh;
  GltfSurface surface;
  SourceLocation location;
  bool skinned = false;  // its vertices are where the joints take them
};

class GltfMeshes {
 public:
  GltfMeshes(GltfScene& scene, GltfBuffers& buffers, GltfMaterials& materials, const GltfValue& root)
      : scene_(scene), buffers_(buffers), materials_(materials), root_(root) {}

  /// The primitives of mesh `index` that can be seen; read once. What can't be used is reported.
  const std::vector<GltfPrimitive>& primitives(size_t index);
  /// The same, bent.
  std::vector<GltfPrimitive> bent(size_t index, const GltfBending& bending);
  /// Whether morph targets are there that could bend the mesh.
  bool has_targets(size_t index) const;

 private:
  std::vector<GltfPrimitive> read(size_t index, const GltfBending* bending);
  void add(const GltfValue& primitive, const GltfBending* bending, std::vector<GltfPrimitive>* out);
  void bend(const GltfValue& primitive, const GltfDeformer& deformer, const GltfBending& bending,
            TriangleMesh* mesh);
  /// The vertices' numbers, as the indices say or one after the other.
  std::vector<uint32_t> order_of(const GltfValue& primitive, size_t vertices);
  /// Points and lines.
  std::shared_ptr<TriangleMesh> loose(const GltfValue& primitive, const GltfAccessor& positions,
                                      const std::optional<GltfAccessor>& colors);
  std::vector<std::array<uint32_t, 3>> triangles(const GltfValue& primitive, size_t vertices);
  std::optional<DracoMesh> unpacked(const GltfValue& primitive);

  GltfScene& scene_;
  GltfBuffers& buffers_;
  GltfMaterials& materials_;
  GltfValue root_;
  std::map<size_t, std::vector<GltfPrimitive>> meshes_;
};

}  // namespace lightmill
