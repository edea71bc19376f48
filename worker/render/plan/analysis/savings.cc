#include "worker/render/plan/analysis/savings.h"

#include <algorithm>
#include <vector>

#include "worker/render/pipeline/recording/thread_time.h"
#include "worker/render/renderer.h"
#include "worker/render/sampling/sobol.h"

namespace lightmill {
namespace {

constexpr int kPackets = 8;

/// CPU seconds of packet `i`, in a cell that is drawn by its number.
double time_packet(const Renderer& renderer, Workspace& workspace, int i) {
  const FilmGrid& grid = renderer.settings().grid;
  const CellRect cells = grid.cells();
  const auto pick = [&](uint32_t salt, int begin, int end) {
    return begin + static_cast<int>(hash_combine(salt, static_cast<uint32_t>(i)) %
                                    static_cast<uint32_t>(end - begin));
  };
  const int x = pick(1, cells.x0, cells.x1), y = pick(2, cells.y0, cells.y1);
  const TileSpec tile{{x, y, x + 1, y + 1}, 0, 1};
  PartialBuilder builder(grid, tile, renderer.quantum_exponent(), renderer.has_camera_layer(),
                         renderer.has_splat_layer());
  const double start = thread_cpu_seconds();
  renderer.render_packet({x, y, 0, 1}, workspace, builder);
  return thread_cpu_seconds() - start;
}

}  // namespace

double measured_saving(const SceneDescription& scene, const RenderSettings& settings, Features feature,
                       double seconds) {
  RenderSettings kept = settings;
  kept.overrides |= feature;
  const Renderer without(scene, settings, 0), with(scene, kept, 0);
  const auto workspace = without.make_workspace(), other = with.make_workspace();
  // The least time of each packet: what disturbs it only adds.
  std::vector<double> least_without(kPackets, 1e300), least_with(kPackets, 1e300);
  double spent = 0;
  for (int round = 0; round < 3 || spent < seconds; ++round) {
    for (int i = 0; i < kPackets; ++i) {
      const auto k = static_cast<size_t>(i);
      const double a = time_packet(without, *workspace, i), b = time_packet(with, *other, i);
      least_without[k] = std::min(least_without[k], a);
      least_with[k] = std::min(least_with[k], b);
      spent += a + b;
    }
  }
  double time_without = 0, time_with = 0;
  for (size_t k = 0; k < kPackets; ++k) time_without += least_without[k], time_with += least_with[k];
  return time_with > 0 ? 1 - time_without / time_with : 0;
}

}  // namespace lightmill
