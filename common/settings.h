#pragma once
// Render settings: what a job renders, after the scene file and the command line were combined.
#include <cstdint>
#include <optional>
#include <string>

#include "common/image/grid.h"
#include "common/strategies.h"

namespace lightmill {

struct SceneDescription;  // common/scene/description.h

enum class Integrator : int { kBdpt = 0, kPt = 1, kLt = 2 };
const char* integrator_name(Integrator integrator);

/// `max_depth` that means "no limit": Russian roulette alone ends paths.
inline constexpr int kUnlimitedDepth = 1 << 20;
/// Largest accepted image, in pixels; bigger ones are refused with one line.
inline constexpr int64_t kMaxPixels = int64_t{1} << 28;
/// Largest accepted side, in pixels.
inline constexpr int kMaxResolution = 65536;

/// Most samples per pixel; also what a job has whose only stop rule is a time or a target error.
inline constexpr int64_t kMaxSpp = int64_t{1} << 31;

/// What the command line may override. Empty means "what the scene says".
struct RenderOptions {
  std::string integrator = "auto";  // auto | bdpt | pt | lt | scene
  std::optional<int64_t> spp;
  std::optional<double> time_s;        // stop after so many seconds of render wall time
  std::optional<double> target_error;  // stop at this estimated relMSE
  std::optional<int> max_depth;        // kUnlimitedDepth for "unlimited"
  std::optional<uint64_t> seed;
  std::optional<int> width, height;
  std::optional<std::array<double, 4>> crop;  // x0,x1,y0,y1 in [0,1], pbrt's order
  bool energy_compensation = false;           // see RenderSettings
  std::optional<std::string> strategies;      // names, see strategies.h
};

/// Everything that, with the bundle digest, determines a partial's bytes; plus the stop rule.
struct RenderSettings {
  Integrator integrator = Integrator::kBdpt;
  FilmGrid grid;
  int64_t spp = 16;   // samples per pixel in total
  int max_depth = 5;  // scattering events (pbrt's meaning); kUnlimitedDepth for no limit
  uint64_t seed = 0;
  double time_s = 0;        // 0: none
  double target_error = 0;  // 0: none
  /// Rough metals get back what one bounce between facets loses. pbrt's images are without.
  bool energy_compensation = false;
  /// Which strategies take part in MIS; empty: the integrator's own.
  std::optional<Strategies> strategies = {};
};

/// The strategies that run. pt: hit and next-event; lt: lens; bdpt: all. Without a scattering event only
/// those that need none are left, of which one suffices.
Strategies strategies_of(const RenderSettings& settings);
/// Whether partials bring a camera layer.
inline bool has_camera_layer(const RenderSettings& settings) {
  return strategies_of(settings) & kCameraLayer;
}
/// Whether partials bring splats.
inline bool has_splat_layer(const RenderSettings& settings) {
  return strategies_of(settings) & kLensConnections;
}

/// Combines the scene's own settings with the options. Throws Error(kUsage) on an option out of
/// range and Error(kBadScene) if the scene's film is.
RenderSettings resolve_settings(const SceneDescription& scene, const RenderOptions& options);

/// Canonical JSON (sorted keys), the form that is stored and sent.
std::string settings_to_json(const RenderSettings& settings);
/// Inverse of settings_to_json; throws Error(kUsage) on malformed input or values out of range.
RenderSettings settings_from_json(const std::string& json);

}  // namespace lightmill
