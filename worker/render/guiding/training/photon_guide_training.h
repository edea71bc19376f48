#pragma once
// Trains the photon guide (guiding/photon_guide.h): where light comes through glass and off mirrors.
//
// Photons (photon_tracing.h) make the guide's tables. Camera paths that go by it then tell whether it pays:
// their densities with the guide and without it give the noise that there would be without it
// (photon_guide_trial.h). Paths without a guide could not tell, as these hardly ever happen among them.
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Gives `scene` a guide where that takes away enough of all noise. `context`: of the scene, the whole film
/// and the strategies that are to run. The result is the same for any number of `threads`.
void train_photon_guide(const StageContext& context, int threads, RenderScene* scene);

}  // namespace lightmill
