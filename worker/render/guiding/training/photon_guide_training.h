#pragma once
// Learns where light comes through glass and off mirrors (guiding/photon_guide.h).
//
// Of photons (photon_tracing.h) the guide's tables are made. Whether it pays is asked of camera paths that go
// by it: from the densities that they had, and would have had without it, follows what the noise would be
// then (photon_guide_trial.h). Paths that hardly ever happen without a guide could not tell.
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Gives `scene` a guide where it takes enough of all noise away. `context`: of the scene, the whole film and
/// the strategies that are to run. On `threads` threads, of which no bit depends.
void learn_caustics(const StageContext& context, int threads, RenderScene* scene);

}  // namespace lightmill
