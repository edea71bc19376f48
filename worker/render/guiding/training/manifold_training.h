#pragma once
// Whether manifold walks (connections/manifold_next_event.h) are worth it, and from where they begin.
#include "worker/render/pipeline/context.h"
#include "worker/render/guiding/training/missing_light.h"

namespace lightmill {

/// Gives `scene`, the one of `context`, seeds of walks if `unmet` says that images lack light, or are noisy
/// where it is met, and walks find most of it; `unmet` becomes what is left. On `threads` threads, of which
/// no bit depends.
void train_manifold_seeds(const StageContext& context, int threads, RenderScene* scene, MissingLight* missing);

}  // namespace lightmill
