#pragma once
// The scale of the exact sums (common/film/exact_sum.h): from the brightest lights, or from what is seen of
// them where that is far from it.
#include "worker/render/plan/analysis/visible_range.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

struct RadianceScale {
  double scale = 0;  // contributions go up to 2^40 of it, in steps of 2^-52
  /// The lights' power does not tell how bright the image is: a lamp is hidden, its light is all but
  /// absorbed, or what shines is a medium.
  bool by_view = false;

  /// Exponent of the sums' quantum.
  int quantum_exponent() const;
};

/// `imaging_ratio` multiplies every contribution; those of `seen` have it already. Scaling the scene leaves
/// the exponent alone: point intensities are brought to radiance by the scene's own extent (1 in normalised
/// space).
RadianceScale radiance_scale(const RenderScene& scene, double imaging_ratio, const VisibleRange& seen);

}  // namespace lightmill
