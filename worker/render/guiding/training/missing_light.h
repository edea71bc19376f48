#pragma once
// Estimates light that an image lacks without any sign of it.
//
// What comes by mirrors and smooth glass to a surface that is only seen by mirrors and smooth glass (LSDSE,
// path_classes.h) can't be joined anywhere. Only camera paths that happen to hit the light bring it. None
// does if the light is at a point or far away. If it is small, a render seems finished long before the first
// one does. Photons tell how much light there is (Jensen 1996, "Global illumination using photon maps"): too
// blurred for an image, but right on the whole. As they know the density of camera paths that come their way,
// they also tell how seldom the light is hit.
#include <array>
#include <string>

#include "worker/render/guiding/training/photon_tracing.h"
#include "worker/render/pipeline/context.h"
#include "worker/render/plan/analysis/scene_plan.h"

namespace lightmill {

struct MissingLight {
  /// By the number of events on its paths, of which those of the camera and of the light are at most
  /// kPhotonDepth each.
  std::array<MissingShare, 2 * kPhotonDepth> parts;
  /// The part of the image's light that manifold walks bring. `parts` of what is never or seldom hit, and the
  /// noise, are without it.
  double walked = 0;
  double image = 0;  // mean radiance of a pixel
  MissingShare up_to(int max_depth) const;
};

/// `context`: of the whole film and the strategies that are to run. The result is the same for any number of
/// `threads`. Images smaller than a cell are not examined.
MissingLight estimate_missing_light(const StageContext& context, int threads);

/// The text of ScenePlan::missing_light.
std::string missing_light_text(const MissingShare& missing);

}  // namespace lightmill
