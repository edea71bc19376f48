#pragma once
// From what a scene says and what the command line overrides to the settings of a job.
#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "common/job/settings.h"

namespace lightmill {

struct SceneDescription;  // description.h

/// What the command line may override. Empty means "what the scene says".
struct RenderOptions {
  std::string integrator = "auto";  // auto | bdpt | pt | lt | scene
  std::optional<int64_t> spp;
  std::optional<double> time_s;        // stop after so many seconds of render wall time
  std::optional<double> target_error;  // stop below this relMSE (error_curve.h, meets_target)
  bool target_denoised = false;        // of the image denoised; also records what that goes by
  std::optional<int> max_depth;        // kUnlimitedDepth for "unlimited"
  std::optional<uint64_t> seed;
  std::optional<int> width, height;
  std::optional<std::array<double, 4>> crop;  // x0,x1,y0,y1 in [0,1], pbrt's order
  bool energy_compensation = false;           // see RenderSettings
  std::optional<std::string> strategies;      // names, see strategies.h; likewise a plan of one's own:
  std::optional<double> light_paths, connections, light_tracing_weight;
  std::optional<int> rr_depth;
  std::optional<SamplingPlan> plan;
  bool uniform_sampling = false;         // see RenderSettings
  std::optional<std::string> overrides;  // names, see features.h
  std::optional<std::string> aovs;       // names, see aovs.h
  bool denoise = false;                  // also records what denoising goes by
};

/// Combines the scene's own settings with the options. Strategies that the scene does not allow
/// (possible_strategies.h) are left out of an integrator's own. Throws Error(kUsage) on an option out of
/// range, or that asks for such a strategy by name, and Error(kBadScene) if the scene's film is out of range.
RenderSettings resolve_settings(const SceneDescription& scene, const RenderOptions& options);

}  // namespace lightmill
