#include "worker/render/pipeline/film.h"

namespace lightmill {

void film_add_to_paths(Wavefront& w) {
  const ShadowRays& q = w.shadow;
  for (int i = 0; i < q.count; ++i) {
    if (q.occluded[i]) continue;
    const auto t = static_cast<size_t>(q.target[i]);
    w.radiance_r[t] += q.r[i];
    w.radiance_g[t] += q.g[i];
    w.radiance_b[t] += q.b[i];
  }
}

void film_add_splats(Wavefront& w) {
  const ShadowRays& q = w.shadow;
  for (int i = 0; i < q.count; ++i) {
    if (!q.occluded[i]) w.splats.push_back({static_cast<uint32_t>(q.target[i]), q.r[i], q.g[i], q.b[i]});
  }
}

void film_finish_pass(int quantum_exponent, Wavefront& w) {
  for (int i = 0; i < kWavefront; ++i) {
    if (!w.slots.taken[i]) continue;
    const float weight = w.slots.weight[i];
    const auto r = to_units(w.radiance_r[i] * weight, quantum_exponent),
               g = to_units(w.radiance_g[i] * weight, quantum_exponent),
               b = to_units(w.radiance_b[i] * weight, quantum_exponent);
    if (!r || !g || !b) {
      ++w.counters.nonfinite;
      continue;
    }
    w.camera_sums[static_cast<size_t>(i)] += {{*r, *g, *b}};
  }
}

}  // namespace lightmill
