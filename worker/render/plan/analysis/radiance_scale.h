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

/// Connections that add less than this to a pixel play Russian roulette: a twentieth of the radiance that the
/// lights' power, spread evenly over all surfaces, would leave with. On the Cornell box this saves 3 % of the
/// time per unit of error; ten times more costs variance. The power of a lamp far from everything, such as a
/// sun made of a sphere, mostly misses the surfaces: they count at least as those of the cube in the scene's
/// bounding sphere.
float tiny_contribution(const RenderScene& scene);

}  // namespace lightmill
