#include "worker/render/plan/analysis/visible_range.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "worker/render/pipeline/pipeline.h"

namespace lightmill {
namespace {

constexpr int kPaths = 1024;
/// Cells of the film that are looked at. The more there are, the fewer of their pixels.
constexpr int kMostCells = 16;
constexpr int64_t kMostSamples = 16;
constexpr size_t kFainter = 16;

void keep(float value, std::vector<float>* values) {
  if (value > 0 && std::isfinite(value)) values->push_back(value);
}

}  // namespace

VisibleRange measure_visible_range(const StageContext& given) {
  StageContext context = given;
  const CellRect cells = context.grid.cells();
  const int count = std::min<int>(static_cast<int>(cells.count()), kMostCells);
  context.pixel_subset = {std::bit_floor(static_cast<uint32_t>(count))};
  const auto wavefront = std::make_unique<Wavefront>();
  Wavefront& w = *wavefront;
  std::vector<float> values;
  int paths = 0;
  for (int64_t s = 0; s < kMostSamples && paths < kPaths; ++s) {
    for (int i = 0; i < count; ++i) {
      const auto cell = static_cast<int>(int64_t{i} * cells.count() / count);
      render_packet(context, {cells.x0 + cell % cells.width(), cells.y0 + cell / cells.width(), s, s + 1}, 0,
                    w, nullptr);
      paths += context.on(kCameraLayer) ? static_cast<int>(w.counters.camera_paths) : w.slots.inside_count;
      for (int slot = 0; context.on(kCameraLayer) && slot < kWavefront; ++slot) {
        if (!w.slots.taken[slot]) continue;
        for (const float* channel : {w.radiance_r, w.radiance_g, w.radiance_b})
          keep(channel[slot] * w.slots.weight[slot], &values);
      }
      for (const Splat& splat : w.splats) {
        for (const float channel : {splat.r, splat.g, splat.b}) keep(channel, &values);
      }
    }
  }
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  return {values[values.size() / kFainter], values.back()};
}

}  // namespace lightmill
