#pragma once
// Which kernels a stage runs. The scene plan chose the set. Only the wavefront knows whether a recorder
// observes it. A wavefront has media where the scene does, so StageContext::kernels need not say so.
//
//   with_kernels(context.kernels.paths, w, [&]<class K>(K) { light_paths<K>(context, layer, w); });
#include "worker/render/pipeline/kernel_set.h"
#include "worker/render/pipeline/work_items.h"

namespace lightmill {

template <class Stage>
void with_kernels(KernelSet chosen, const Wavefront& w, Stage&& stage) {
  if (w.media) return stage(MediaKernels{});
  if (chosen == KernelSet::kDiffuse && !w.recorder && !w.aovs) return stage(DiffuseKernels{});
  stage(SurfaceKernels{});
}

/// The recorder; null at compile time in kernels that nothing observes.
template <class K>
StrategyRecorder* recorder_of(const Wavefront& w) {
  if constexpr (!K::kObserved) return nullptr;
  return w.recorder;
}

}  // namespace lightmill
