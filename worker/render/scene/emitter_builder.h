#pragma once
// Turns shapes that emit into records of the light table. Everything that rounds happens once, in double.
#include <array>
#include <optional>
#include <vector>

#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// An emitter that no ray can meet: see AreaLightDescription.
inline bool is_unseen_emitter(const ShapeDescription& shape) {
  return shape.area_light >= 0 && shape.alpha.texture < 0 && shape.alpha.value == 0;
}

class EmitterBuilder {
 public:
  /// Both must outlive the builder.
  EmitterBuilder(const SceneDescription& description, RenderScene* scene);
  /// All shapes to come, which share the look-ups that their means may cost. Call before any is added.
  void expect(const std::vector<const ShapeDescription*>& shapes);

  /// Adds the triangle of vertices i[3], part of `shape`, whose geometry is in the scene already; returns its
  /// index in scene->lights, or -1 if it is dark. `winding` is its unit normal, `area` its area, `flags` the
  /// primitive's. Throws Error(kBadScene) with the light's place for an image that cannot shine.
  int32_t add_triangle(const ShapeDescription& shape, const int32_t* i, const Vec3d& winding, double area,
                       int32_t flags);
  /// The same for the last sphere of the scene.
  int32_t add_sphere(const ShapeDescription& shape);
  /// Some emitter added is textured, or its alpha is.
  bool any_texture() const { return any_texture_; }

 private:
  /// An area light, ready for its shapes.
  struct Source {
    Rgb radiance;
    double least_mean = 0;  // of the texture, below which no part of it is thought to be
    float brightest = 1;
    int width = 0, height = 0;  // of the image; 0: the texture is none
  };
  const Source& source(int area_light);
  void take_image(const AreaLightDescription& light, Source* s) const;
  int32_t add(LightType type, const ShapeDescription& shape, double area,
              std::array<float, kLightFloats>& record, const std::array<float, 9>& frame,
              const int32_t* vertices);
  bool shows_black(LightType type, const EmitterPattern& pattern) const;
  double mean_factor(LightType type, const Source& source, const EmitterPattern& pattern,
                     const std::array<float, kLightFloats>& record) const;

  const SceneDescription& in_;
  RenderScene& out_;
  std::vector<std::optional<Source>> sources_;  // per area light
  double samples_ = 4;                          // of the texture, for each emitter's mean
  bool any_texture_ = false;
};

}  // namespace lightmill
