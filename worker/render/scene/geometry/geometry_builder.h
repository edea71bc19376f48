#pragma once
// Writes shapes into a scene's flat arrays: vertices, triangles, spheres, and for each primitive its
// material, light, flags and media. Everything that rounds happens once, here, in double.
#include <array>
#include <span>
#include <string>
#include <vector>

#include "common/scene/parts_in_use.h"
#include "worker/render/scene/coincidence/coincident_spheres.h"
#include "worker/render/scene/geometry/instancing.h"
#include "worker/render/scene/geometry/shape_space.h"
#include "worker/render/scene/lights/emitter_builder.h"
#include "worker/render/scene/media/media_builder.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// A triangle of an object that emits. Its light's record is in the object's space until its place is known.
struct ObjectEmitter {
  int32_t light = -1;
  std::array<int32_t, 3> vertices{};
  MeshBend bend;
};

class GeometryBuilder {
 public:
  /// The arguments must outlive the builder.
  GeometryBuilder(const SceneDescription& description, const MediaBuilder& media, EmitterBuilder& emitters,
                  RenderScene* scene)
      : in_(description), media_(media), emitters_(emitters), out_(*scene) {}

  /// Reserves room for all shapes to come, and says which attributes of vertices something reads. The scene
  /// must have its materials. Throws Error(kBadScene) if there are too many shapes.
  void reserve(const std::vector<const ShapeDescription*>& shapes, const PartsInUse& parts);

  /// Sets the space that the following shapes are kept in, and what surfaces that coincide there need.
  void set_space(const ShapeSpace& space, const CoincidenceSpace& coincidence) {
    space_ = space;
    coincidence_ = coincidence;
    moved_ = 0;
  }
  const ShapeSpace& space() const { return space_; }
  /// How far the surfaces of shapes that were added since may lie from where they belong, beside rounding.
  double moved() const { return moved_; }
  /// Adds those of `shapes` that are meshes; then, after all meshes of the scene, those that are spheres.
  /// Surfaces among them that coincide are set apart (coincident_faces.h).
  void add_meshes(const std::vector<const ShapeDescription*>& shapes);
  void add_spheres(const std::vector<const ShapeDescription*>& shapes);
  /// Tells triangles that bend from others, if there are some. Call after all meshes.
  void finish_bends();
  /// Warns of the surfaces that coincide. Call after all shapes.
  void report();
  /// Gives `sides` to the lights that were added since the last call.
  void surround_lights(int32_t sides);

  /// All that there are, in the order of their objects.
  const std::vector<ObjectEmitter>& object_emitters() const { return object_emitters_; }
  /// Per material of the scene: whether some primitive is made of it.
  const std::vector<bool>& materials_in_use() const { return used_; }

 private:
  struct TriangleArea {
    double area = 0;
    Vec3d normal;  // unit, of the winding
  };
  static TriangleArea triangle_area(const std::array<Vec3d, 3>& p);
  std::array<Vec3d, 3> rounded_corners(const int32_t* i) const;
  TriangleArea unrounded(const Matrix& m, const TriangleMesh& mesh, const std::array<uint32_t, 3>& t) const;
  bool is_of_fibres(const ShapeDescription& s) const;
  int32_t outwards(const MeshRange& range, bool reversed) const;
  /// Objects bend; what is copied into the world is as it is at first.
  bool in_object() const { return !coincidence_.has_viewer; }
  bool bends_here(const ShapeDescription& s) const { return in_object() && bends(s); }
  void add_vertices(const ShapeDescription& s, const TriangleMesh& mesh);
  void add_block(const ShapeDescription& s, const TriangleMesh& mesh, const std::vector<Vec3f>& positions,
                 const std::vector<Vec3f>& normals);
  /// The largest area that a triangle has at the steps of a mesh.
  double largest_area(const int32_t* corners, size_t vertices, size_t steps) const;
  std::vector<FaceId> separate(const std::vector<const ShapeDescription*>& shapes,
                               const std::vector<PlacedMesh>& meshes);
  void add_mesh(const ShapeDescription& s, const PlacedMesh& placed, std::span<const FaceId> left_out);
  PlacedSphere placed_sphere(const ShapeDescription& s, const SphereShape& sphere) const;
  void add_sphere(const ShapeDescription& s, const std::array<float, 4>& record);
  void note(const CoincidentFaces& found, size_t* count);
  void add_primitive(const ShapeDescription& s, int32_t light, int32_t flags);
  void use_material(const ShapeDescription& s);
  void warn(const ShapeDescription& s, std::string what);

  const SceneDescription& in_;
  const MediaBuilder& media_;
  EmitterBuilder& emitters_;
  RenderScene& out_;
  ShapeSpace space_;
  CoincidenceSpace coincidence_;
  double moved_ = 0;
  size_t faces_on_others_ = 0, spheres_on_others_ = 0;
  std::vector<SourceLocation> coincident_;  // the shapes
  std::vector<ObjectEmitter> object_emitters_;
  bool keep_uvs_ = false;
  std::vector<bool> used_;
};

}  // namespace lightmill
