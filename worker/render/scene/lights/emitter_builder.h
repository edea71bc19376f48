#pragma once
// Turns shapes that emit into records of the light table. Everything that rounds happens once, in double.
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "worker/render/scene/lights/emitter_copies.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// An emitter that no ray can meet: see AreaLightDescription.
inline bool is_unseen_emitter(const ShapeDescription& shape) {
  return shape.area_light >= 0 && shape.alpha.texture < 0 && shape.alpha.value == 0;
}

/// A triangle whose vertices are in the scene already.
struct EmittingTriangle {
  const int32_t* vertices;  // 3
  Vec3d winding;            // unit normal
  double area;              // normalised space
  int32_t flags;            // the primitive's
  bool unseen;              // it has no primitive that a ray could meet
};

class EmitterBuilder {
 public:
  /// The arguments must outlive the builder.
  EmitterBuilder(const SceneDescription& description, RenderScene* scene);
  /// Names all shapes to come. They share the number of look-ups that their means may cost. Call before any
  /// is added.
  void expect(const std::vector<const ShapeDescription*>& shapes);

  /// Whether `t`, part of `shape`, lies on another emitter that shines from the same side. If so, leave it
  /// out; if not, it is remembered.
  bool is_copy(const ShapeDescription& shape, const EmittingTriangle& t);
  /// The same for the last sphere of the scene.
  bool is_copied_sphere(const ShapeDescription& shape);
  /// Warns of the copies that were found. Call after all shapes.
  void report();
  /// Adds `t`, part of `shape`; returns its index in scene->lights, or -1 if it is dark. Throws
  /// Error(kBadScene) with the light's place for an image that cannot shine.
  int32_t add_triangle(const ShapeDescription& shape, const EmittingTriangle& t);
  /// The same for the last sphere of the scene.
  int32_t add_sphere(const ShapeDescription& shape);
  /// Whether some emitter that was added is textured, or its alpha is.
  bool any_texture() const { return any_texture_; }

 private:
  /// An area light, ready for its shapes.
  struct Source {
    Rgb radiance;
    double least_mean = 0;  // of the texture: a lower bound for the mean of any part
    float brightest = 1;
    int width = 0, height = 0;  // of the image; 0: the texture is none
  };
  const Source& source(int area_light);
  void take_image(const AreaLightDescription& light, Source* s) const;
  int32_t add(LightType type, const ShapeDescription& shape, double area,
              std::array<float, kLightFloats>& record, const std::array<float, 9>& frame,
              const int32_t* vertices, bool unseen);
  void count_copy(const ShapeDescription& shape);
  double emitting_side(const EmittingTriangle& t) const;
  bool shows_black(LightType type, const EmitterPattern& pattern) const;
  struct Factor {
    double mean = 0;
    float most = 0;
  };
  Factor factor(LightType type, const Source& source, const EmitterPattern& pattern,
                const std::array<float, kLightFloats>& record) const;

  const SceneDescription& in_;
  RenderScene& out_;
  std::vector<std::optional<Source>> sources_;  // per area light
  EmitterCopies copies_;
  std::vector<std::pair<const ShapeDescription*, size_t>> copied_;  // how many of a shape are left out
  double samples_ = 4;                                              // of the texture, for each emitter's mean
  bool any_texture_ = false;
};

}  // namespace lightmill
