#pragma once
// Renders a scene while recording what every strategy does: its images, its share of noise and time, the
// brightest paths, and all that was discarded.
#include <functional>

#include "common/job/settings.h"
#include "common/scene/description.h"
#include "worker/render/diagnose/strategy_film.h"
#include "worker/render/renderer.h"

namespace lightmill {

/// One of the largest contributions, with its path from the camera and from the light.
struct BrightPath {
  StrategyContribution contribution;
  int cell_x = 0, cell_y = 0;
  int64_t sample = 0;
  struct Vertex {
    Vec3d position;  // world space
    int material = 0;
    float throughput[3] = {0, 0, 0};
  };
  std::vector<Vertex> camera, light;  // surface vertices, from the camera and from the light
};

struct Diagnosis {
  Diagnosis(const FilmGrid& grid, const SplatStatistics& splats)
      : film(grid.width, grid.height, splats), pixels(grid.crop.area()) {}
  Image image;
  StrategyFilm film;
  int64_t pixels;  // rendered
  StrategyRecorder::Table counts{};
  RenderCounters counters;
  Dropped dropped;
  double light_subpath_seconds = 0, camera_subpath_seconds = 0, cpu_seconds = 0;
  uint64_t inconsistent_hits = 0;
  std::vector<BrightPath> brightest;  // descending
};

/// Largest memory for strategy images, bytes.
inline constexpr int64_t kDiagnosisBytes = int64_t{4} << 30;

/// Renders `settings.spp` samples per pixel of `scene` on `threads` threads. `go_on` is asked between
/// samples; once false, Error(kFailed) is thrown. Throws Error(kUsage) if the strategy images would need more
/// than kDiagnosisBytes.
Diagnosis diagnose(const SceneDescription& scene, const RenderSettings& settings, int threads,
                   const std::function<bool()>& go_on);

}  // namespace lightmill
