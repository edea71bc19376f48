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

void film_finish_layer(const StageContext& context, const LayerContext& layer, int quantum_exponent,
                       Wavefront& w) {
  const PixelRect& crop = context.grid.crop;
  for (int i = 0; i < kWavefront; ++i) {
    const int x = layer.cell_x * kCellSize + i % kCellSize, y = layer.cell_y * kCellSize + i / kCellSize;
    if (x < crop.x0 || x >= crop.x1 || y < crop.y0 || y >= crop.y1) continue;
    const auto r = to_units(w.radiance_r[i], quantum_exponent),
               g = to_units(w.radiance_g[i], quantum_exponent),
               b = to_units(w.radiance_b[i], quantum_exponent);
    if (!r || !g || !b) {
      ++w.counters.nonfinite;
      continue;
    }
    w.camera_sums[static_cast<size_t>(i)] += {{*r, *g, *b}};
  }
}

}  // namespace lightmill
