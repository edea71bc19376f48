#pragma once
// Light that an image lacks without anything telling of it. What comes by mirrors and smooth glass to a
// surface that is only seen by mirrors and smooth glass (LSDSE, path_classes.h) can't be joined anywhere:
// those camera paths alone bring it that happen to meet the light. None does if the light is at a point or
// far away; and if it is small, a render looks finished long before the first one does. Photons tell how much
// there is (Jensen 1996, "Global illumination using photon maps"), too blurred for an image but right on the
// whole, and how seldom it is met, as they know the density of camera paths that come their way.
#include <array>
#include <string>

#include "worker/render/pipeline/context.h"
#include "worker/render/guiding/training/photon_tracing.h"
#include "worker/render/plan/analysis/scene_plan.h"

namespace lightmill {

struct MissingLight {
  /// By events on its paths, of which those of the camera and of the light are at most kPhotonDepth each.
  std::array<MissingShare, 2 * kPhotonDepth> parts;
  /// Of the image's light, that manifold walks bring. What is never or seldom met and the noise are without
  /// it.
  double walked = 0;
  double image = 0;  // mean radiance of a pixel
  MissingShare up_to(int max_depth) const;
};

/// `context`: of the whole film and the strategies that are to run. On `threads` threads, of which no bit
/// depends. Nothing is found out about images smaller than a cell.
MissingLight estimate_missing_light(const StageContext& context, int threads);

/// ScenePlan::missing_light.
std::string missing_light_text(const MissingShare& missing);

}  // namespace lightmill
