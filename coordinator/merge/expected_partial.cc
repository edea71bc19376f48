#include "coordinator/merge/expected_partial.h"

#include <algorithm>
#include <string>

#include "common/base/error.h"
#include "common/job/light_path_count.h"

namespace lightmill {
namespace {

/// A worker may report any time it likes; only plausible ones count.
constexpr double kMaxCpuSeconds = 1e7;

// Bytes of an encoded partial, at most.
constexpr uint64_t kPartialOverhead = 1 << 20;
constexpr uint64_t kBytesPerSum = 48;    // three 128-bit sums
constexpr uint64_t kBytesPerSplat = 54;  // and its pixel
// Bytes of an unpacked one.
constexpr double kDecodedPerSum = 64, kDecodedPerSplat = 80;

/// Light paths that every honest partial of the tile has traced.
uint64_t expected_light_paths(const TileSpec& tile, const RenderSettings& settings) {
  const SamplingPlan plan = plan_of(settings);
  if (!(plan.strategies & kLightPaths)) return 0;
  uint64_t per_sample = 0;
  for (int y = tile.cells.y0; y < tile.cells.y1; ++y) {
    for (int x = tile.cells.x0; x < tile.cells.x1; ++x) {
      per_sample += static_cast<uint64_t>(
          light_paths_of_layer(plan.light_paths, settings.grid.pixels({x, y, x + 1, y + 1}).area()));
    }
  }
  return per_sample * static_cast<uint64_t>(tile.samples());
}

}  // namespace

void check_partial(const Partial& partial, const TileSpec& tile, const RenderSettings& settings,
                   const std::optional<int>& quantum_exponent) {
  const auto refuse = [](const std::string& why) {
    throw Error(ErrorKind::kFailed, "partial refused: " + why);
  };
  if (quantum_exponent && partial.quantum_exponent != *quantum_exponent) {
    refuse("its quantum is 2^" + std::to_string(partial.quantum_exponent) + ", the job's is 2^" +
           std::to_string(*quantum_exponent));
  }
  const bool wants_camera = has_camera_layer(settings);
  if (partial.camera.empty() == wants_camera) {
    refuse(wants_camera ? "its camera layer is missing"
                        : "the job's strategies have no camera layer, but it brings one");
  }
  if (!has_splat_layer(settings) && !partial.splats.empty()) {
    refuse("the job's strategies make no splats, but it brings some");
  }
  const auto require_count = [&](const char* what, uint64_t count, uint64_t expected) {
    if (count == expected) return;
    refuse("it counts " + std::to_string(count) + " " + what + ", its tile has " + std::to_string(expected));
  };
  const uint64_t light_paths = expected_light_paths(tile, settings);
  require_count("light paths", partial.counters.light_paths, light_paths);
  require_count("light paths behind its splats", partial.light_paths,
                has_splat_layer(settings) ? light_paths : 0);
  const PathCount paths =
      wants_camera ? camera_paths_of(plan_of(settings).allocation, settings.grid, tile) : PathCount{};
  const uint64_t camera_paths = partial.counters.camera_paths;
  require_count("camera paths", camera_paths, std::clamp(camera_paths, paths.least, paths.most));
  if (partial.aovs.spec.set != settings.aovs) {
    refuse("it brings the AOVs \"" + aov_names(partial.aovs.spec.set) + "\", the job asked for \"" +
           aov_names(settings.aovs) + "\"");
  }
  if (partial.aovs.spec.weighted != (settings.aovs && !plan_of(settings).allocation.uniform()))
    refuse("its samples' weights are not those of the job's sample allocation");
  if (partial.aovs.spec.groups != settings.light_groups) {
    refuse("it brings the light groups \"" + light_groups_text(partial.aovs.spec.groups) +
           "\", the job's scene has \"" + light_groups_text(settings.light_groups) + "\"");
  }
  if (!(partial.cpu_seconds >= 0 && partial.cpu_seconds <= kMaxCpuSeconds))
    refuse("its CPU time is out of range");
}

double decoded_bytes(const TileSpec& tile, const RenderSettings& settings) {
  const auto pixels = static_cast<double>(settings.grid.pixels(tile.cells).area());
  const auto window = static_cast<double>(settings.grid.crop.area());
  const double aovs =
      settings.aovs ? 2 * static_cast<double>(max_aov_bytes(static_cast<size_t>(pixels), settings.grid,
                                                            settings.light_groups.size(), settings.aovs))
                    : 0;
  const double mattes = settings.aovs & kAovsOfCounts ? 2 * kMatteBytesPerPixel * pixels : 0;
  return kDecodedPerSum * pixels + (has_splat_layer(settings) ? kDecodedPerSplat * window : 0) + aovs +
         mattes;
}

uint64_t max_encoded_bytes(const TileSpec& tile, const RenderSettings& settings) {
  const FilmGrid& grid = settings.grid;
  const auto tile_pixels = static_cast<size_t>(grid.pixels(tile.cells).area());
  uint64_t aovs =
      settings.aovs ? max_aov_bytes(tile_pixels, grid, settings.light_groups.size(), settings.aovs) : 0;
  if (settings.aovs & kAovsOfCounts)
    aovs += max_matte_bytes(static_cast<size_t>(tile.cells.count()),
                            most_matte_counts(tile_pixels, tile.samples()));
  return kPartialOverhead + tile_pixels * kBytesPerSum +
         static_cast<uint64_t>(grid.crop.area()) * kBytesPerSplat + aovs;
}

}  // namespace lightmill
