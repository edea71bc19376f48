#pragma once
// Media of a scene description as records, what lies on the sides of its shapes, and which of them are panes.
#include <vector>

#include "worker/render/scene/render_scene.h"

namespace lightmill {

class MediaBuilder {
 public:
  /// Both must outlive the builder. Media that nothing in `shapes`, no light and not the camera touches are
  /// left out, and so are those that do nothing: if none is left, the scene has no media.
  MediaBuilder(const SceneDescription& description, const std::vector<const ShapeDescription*>& shapes);

  /// Media or panes.
  bool any() const { return count_ > 0 || any_panes_; }
  /// Whether rays can't meet the shape: it is no surface, and no boundary either.
  bool is_nothing(const ShapeDescription& shape) const { return shape.boundary && count_ == 0; }
  /// See pane.h.
  bool is_pane(const ShapeDescription& shape) const;
  /// Writes the records once scene->scale_exponent is known. Throws Error(kBadScene) if there are too many,
  /// or coefficients that float cannot hold at the scene's scale.
  void write(RenderScene* scene) const;
  /// As RenderScene::primitive_media has it.
  int32_t sides(const ShapeDescription& shape) const;
  /// Of something that stands in medium `index` of the description.
  int32_t around(int index) const { return medium_sides(number(index), number(index)); }
  int32_t number(int index) const { return index < 0 ? 0 : number_[static_cast<size_t>(index)]; }

 private:
  const SceneDescription& in_;
  std::vector<int32_t> number_;  // per medium of the description; 0: it does nothing or is not used
  int32_t count_ = 0;
  bool any_panes_ = false;
};

}  // namespace lightmill
