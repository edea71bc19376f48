#pragma once
// Turns the media of a scene description into records, and finds the media on the sides of its shapes and
// which shapes are panes.
#include <memory>
#include <vector>

#include "worker/render/scene/render_scene.h"

namespace lightmill {

class MediaBuilder {
 public:
  /// `description` must outlive the builder. Left out are media that do nothing, and those that are not used
  /// by `shapes`, a light or the camera. If none is left, the scene has no media. Reads the files of grids,
  /// and throws Error(kBadScene) where one can't be read. `area` bounds the memory of grids (null: nothing
  /// does).
  MediaBuilder(const SceneDescription& description, const std::vector<const ShapeDescription*>& shapes,
               std::shared_ptr<SpillArea> area, std::vector<Problem>* warnings);

  /// Whether there are media or panes.
  bool any() const { return count_ > 0 || any_panes_; }
  /// Whether rays can't meet the shape: it is neither a surface nor a boundary.
  bool is_nothing(const ShapeDescription& shape) const { return shape.boundary && count_ == 0; }
  /// See pane.h.
  bool is_pane(const ShapeDescription& shape) const;
  /// Corners of the boxes of grids, in the world, wherever they move.
  std::vector<Vec3d> grid_corners() const;
  /// Writes the records and grids, which it then has no longer. scene->scale_exponent must be known. Throws
  /// Error(kBadScene) if there are too many, or if float cannot hold their coefficients at the scene's scale.
  void write(int threads, RenderScene* scene);
  /// The shape's sides, as in RenderScene::primitive_media.
  int32_t sides(const ShapeDescription& shape) const;
  /// Sides of something that stands in medium `index` of the description.
  int32_t around(int index) const { return medium_sides(number(index), number(index)); }
  int32_t number(int index) const { return index < 0 ? 0 : number_[static_cast<size_t>(index)]; }

 private:
  const SceneDescription& in_;
  std::shared_ptr<SpillArea> area_;
  std::vector<MediumDescription> media_;      // those of the description, with what is in their files
  std::vector<std::vector<Transform>> ways_;  // of grids that move
  std::vector<int32_t> number_;  // per medium of the description; 0: it does nothing or is not used
  int32_t count_ = 0;
  bool any_panes_ = false;
};

}  // namespace lightmill
