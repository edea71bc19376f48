#include "common/scene/gltf/default_light.h"

#include <algorithm>

#include "common/scene/mesh/mesh_check.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

/// Of all surfaces that light falls on, the mean of what they emit.
class Emission {
 public:
  explicit Emission(const SceneDescription& scene) : scene_(scene) {}

  void add(const std::vector<ShapeDescription>& shapes, const Transform& to_world) {
    for (const ShapeDescription& shape : shapes) {
      const auto* mesh = std::get_if<MeshShape>(&shape.kind);
      const auto* diffuse =
          std::get_if<DiffuseMaterial>(&scene_.materials.at(static_cast<size_t>(shape.material)).kind);
      const bool unlit = shape.area_light >= 0 && diffuse != nullptr && diffuse->reflectance.texture < 0 &&
                         diffuse->reflectance.value == Rgb{};
      if (mesh == nullptr || unlit) continue;
      const double area = mesh_area(*mesh->mesh, to_world * shape.object_to_world);
      area_ += area;
      if (shape.area_light < 0) continue;
      const AreaLightDescription& light = scene_.area_lights.at(static_cast<size_t>(shape.area_light));
      const float most = std::max({light.radiance.r, light.radiance.g, light.radiance.b});
      if (light.texture < 0 || most > 1) flux_ += area * double{most};
    }
  }
  bool is_enough() const {
    constexpr double kLeast = 0.02;  // a lamp in a room gives more, lights of a car less
    return !(flux_ < kLeast * area_);
  }

 private:
  const SceneDescription& scene_;
  double area_ = 0, flux_ = 0;
};

}  // namespace

void light_up_if_dark(GltfScene& out) {
  constexpr float kSky = 0.4f, kLamp = 2;
  const SceneDescription& scene = out.scene;
  Emission emission(scene);
  emission.add(scene.shapes, {});
  for (const InstanceDescription& i : scene.instances)
    emission.add(scene.objects.at(static_cast<size_t>(i.object)).shapes, i.object_to_world);
  if (!scene.lights.empty() || emission.is_enough()) return;
  out.warning("",
              std::string(scene.area_lights.empty() ? "nothing in the scene emits light"
                                                    : "the scene has no light but surfaces that glow") +
                  "; it is lit by a grey sky and from above the camera's left (--environment FILE gives it a "
                  "picture)");
  const SourceLocation where{out.name, 1, 1};
  Vec3d d = transform_vector(scene.camera.camera_to_world, {0.5, -0.7, 0.8});
  const double n = length(d);
  out.scene.lights.push_back({DistantLight{{kLamp, kLamp, kLamp}, {d.x / n, d.y / n, d.z / n}}, where});
  out.scene.lights.push_back({InfiniteLight{{kSky, kSky, kSky}}, where});
}

}  // namespace lightmill
