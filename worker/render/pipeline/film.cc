#include "worker/render/pipeline/film.h"

#include "common/film/signed_sum.h"
#include "worker/render/pipeline/connections/splat_target.h"

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
  const auto add = [&](int i, int32_t pixel, float f) {
    w.splats.push_back({static_cast<uint32_t>(pixel), f * q.r[i], f * q.g[i], f * q.b[i]});
    if (context.response) context.response->mix(&w.splats.back().r, &w.splats.back().g, &w.splats.back().b);
  };
  const bool spread = !context.filter.is_one_pixel();
  // As many as there are lanes are spread at a time.
  int from[kLanes], count = 0;
  const auto spread_all = [&] {
    float x[kLanes] = {}, y[kLanes] = {}, u[kLanes];
    for (int l = 0; l < count; ++l) {
      x[l] = q.raster_x[from[l]];
      y[l] = q.raster_y[from[l]];
      u[l] = q.small_choice[from[l]];
    }
    spread_splats(context, load<Lane>(x), load<Lane>(y), u, count,
                  [&](int l, int32_t at, float f) { add(from[l], at, f); });
    count = 0;
  };
  for (int i = 0; i < q.count; ++i) {
    if (q.occluded[i]) continue;
    if (!spread) {
      add(i, q.target[i], 1);
      continue;
    }
    from[count++] = i;
    if (count == kLanes) spread_all();
  }
  if (count > 0) spread_all();
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
    w.camera_sums[static_cast<size_t>(w.slots.pixel[i])] += {{*r, *g, *b}};
  }
}

}  // namespace lightmill
