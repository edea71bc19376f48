#include "worker/render/pipeline/film.h"

#include <array>

#include "common/film/signed_sum.h"
#include "worker/render/pipeline/connections/splat_target.h"
#include "worker/render/pipeline/paths/path_radiance.h"

namespace lightmill {

void film_add_to_paths(Wavefront& w) {
  const ShadowRays& q = w.shadow;
  for (int i = 0; i < q.count; ++i) {
    if (q.occluded[i]) continue;
    const LobeOf lobe = w.lobes ? w.lobes->of_shadow_ray(static_cast<size_t>(i)) : LobeOf{};
    add_to_path(w, static_cast<size_t>(q.target[i]), q.r[i], q.g[i], q.b[i], w.groups ? q.group[i] : 0, lobe);
  }
}

void film_add_splats(const StageContext& context, Wavefront& w) {
  const ShadowRays& q = w.shadow;
  const auto add = [&](int i, int32_t pixel, float share) {
    const float f = share * context.light_factor;
    w.splats.push_back({static_cast<uint32_t>(pixel), f * q.r[i], f * q.g[i], f * q.b[i]});
    if (w.groups) w.groups->splat_groups.push_back(static_cast<uint8_t>(q.group[i]));
    if (w.lobes) {
      const LobeOf lobe = w.lobes->of_shadow_ray(static_cast<size_t>(i));
      w.lobes->light.splat_groups.push_back(static_cast<uint8_t>(lobe.part));
      const Splat& whole = w.splats.back();
      std::array<float, 3> diffuse = {lobe.diffuse[0] * whole.r, lobe.diffuse[1] * whole.g,
                                      lobe.diffuse[2] * whole.b};
      if (context.response) context.response->mix(&diffuse[0], &diffuse[1], &diffuse[2]);
      w.lobes->splat_diffuse.push_back(diffuse);
    }
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
    if (!is_finite(q.r[i], q.g[i], q.b[i])) {
      drop_not_finite_light(w);
      continue;
    }
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
    const float full_weight = w.slots.weight[i];
    float limit = 1;
    if (const FilmResponse* response = context.response) {
      limit = response->limit(w.radiance_r[i], w.radiance_g[i], w.radiance_b[i]);
      w.slots.weight[i] *= limit;
      response->mix(&w.radiance_r[i], &w.radiance_g[i], &w.radiance_b[i]);
    }
    const float weight = w.slots.weight[i];
    const std::array<float, 3> rgb = {w.radiance_r[i] * weight, w.radiance_g[i] * weight,
                                      w.radiance_b[i] * weight};
    const auto r = units(rgb[0]), g = units(rgb[1]), b = units(rgb[2]);
    if (!r || !g || !b) {
      ++w.counters.nonfinite;
      w.dropped.refuse(rgb, quantum_exponent, full_weight);
      continue;
    }
    if (limit < 1) {
      const double radiance = mean_magnitude({w.radiance_r[i], w.radiance_g[i], w.radiance_b[i]});
      w.dropped.add(DropKind::kCapped, radiance * (full_weight - weight));
    }
    if (!(*r | *g | *b)) w.dropped.round_to_zero(rgb);
    w.camera_sums[static_cast<size_t>(w.slots.pixel[i])] += {{*r, *g, *b}};
  }
}

}  // namespace lightmill
