#pragma once
// Decides whether manifold walks (connections/manifold_next_event.h) are worth it, and makes their seeds.
#include "worker/render/guiding/training/missing_light.h"
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Gives `scene`, the one of `context`, seeds of walks, if `missing` says that images lack light or that
/// emitter hits are noisy, and if walks find most of that light. `missing` becomes what is left. The result
/// is the same for any number of `threads`.
void train_manifold_seeds(const StageContext& context, int threads, RenderScene* scene,
                          MissingLight* missing);

}  // namespace lightmill
