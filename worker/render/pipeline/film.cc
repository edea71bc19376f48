#include "worker/render/pipeline/film.h"

#include "common/image/signed_sum.h"
#include "worker/render/pipeline/splat_target.h"

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

void film_add_splats(const StageContext& context, Wavefront& w) {
  const ShadowRays& q = w.shadow;
  for (int i = 0; i < q.count; ++i) {
    if (q.occluded[i]) continue;
    const int32_t pixel = q.target[i] & ~kNegativeSplat;
    const float sign = q.target[i] & kNegativeSplat ? -1.0f : 1.0f;
    Splat& splat = w.splats.emplace_back(
        Splat{static_cast<uint32_t>(pixel), sign * q.r[i], sign * q.g[i], sign * q.b[i]});
    if (context.response) context.response->mix(&splat.r, &splat.g, &splat.b);
  }
}

void film_finish_pass(const StageContext& context, int quantum_exponent, Wavefront& w) {
  const auto units = [&](float x) {
    return context.signed_film ? to_signed_units(x, quantum_exponent) : to_units(x, quantum_exponent);
  };
  for (int i = 0; i < kWavefront; ++i) {
    if (!w.slots.taken[i]) continue;
    if (const FilmResponse* response = context.response) {
      w.slots.weight[i] *= response->limit(w.radiance_r[i], w.radiance_g[i], w.radiance_b[i]);
      response->mix(&w.radiance_r[i], &w.radiance_g[i], &w.radiance_b[i]);
    }
    const float weight = w.slots.weight[i];
    const auto r = units(w.radiance_r[i] * weight), g = units(w.radiance_g[i] * weight),
               b = units(w.radiance_b[i] * weight);
    if (!r || !g || !b) {
      ++w.counters.nonfinite;
      continue;
    }
    w.camera_sums[static_cast<size_t>(i)] += {{*r, *g, *b}};
  }
}

}  // namespace lightmill
