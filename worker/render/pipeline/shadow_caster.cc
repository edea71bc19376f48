#include "worker/render/pipeline/shadow_caster.h"

#include "worker/render/pipeline/film.h"
#include "worker/render/pipeline/paths/path_times.h"
#include "worker/render/pipeline/recording/stage_probe.h"
#include "worker/render/pipeline/recording/strategy_recorder.h"
#include "worker/render/pipeline/recording/thread_time.h"
#include "worker/render/pipeline/walks/medium_walk.h"

namespace lightmill {

void flush_shadow_rays(const StageContext& context, bool splats, Wavefront& w) {
  ShadowRays& q = w.shadow;
  if (q.count == 0) return;
  const RayKinds kinds = splats ? kCameraRays : kShadowRays;
  const bool timed = w.recorder && w.recorder->timed;
  const double start = timed ? thread_cpu_seconds() : 0;
  if (w.probe) w.probe->occluded(q);
  {
    const StageScope scope(w, Stage::kOcclude);
    if (w.media) {
      trace_transmittance(context, kinds, w);
    } else {
      context.accel.occluded(view_of(context.scene, q), q.tfar, q.count, q.occluded, nullptr, kinds);
    }
  }
  w.counters.shadow_rays += static_cast<uint64_t>(q.count);
  if (w.recorder) {
    const double seconds = timed ? thread_cpu_seconds() - start : 0;
    w.recorder->resolved(context, q, splats, seconds, w.media.get());
  }
  const StageScope scope(w, Stage::kFilm);
  if (splats) {
    film_add_splats(context, w);
  } else {
    film_add_to_paths(w);
  }
  q.count = 0;
}

}  // namespace lightmill
