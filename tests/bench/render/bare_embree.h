#pragma once
// Rays through Embree and nothing else: the limit that a renderer built on it can come to.
#include <memory>
#include <vector>

#include "worker/render/pipeline/recording/stage_probe.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill::bench {

class BareEmbree {
 public:
  /// Builds the tree that the renderer would build. Throws Error(kBadScene) for scenes with spheres,
  /// instances or alpha masks, of which our own code takes part in the traversal.
  explicit BareEmbree(const RenderScene& scene);
  ~BareEmbree();
  BareEmbree(const BareEmbree&) = delete;
  BareEmbree& operator=(const BareEmbree&) = delete;

  /// Packs rays eight by eight, in their order.
  void take(const std::vector<StageProbe::Segment>& closest,
            const std::vector<StageProbe::Segment>& occlusion);
  /// Traces what was taken. CPU seconds.
  double closest_seconds();
  double occlusion_seconds();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightmill::bench
