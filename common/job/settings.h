#pragma once
// Render settings: what a job renders, after the scene file and the command line were combined.
#include <cstdint>
#include <optional>
#include <string>

#include "common/base/error.h"
#include "common/job/aovs.h"
#include "common/job/features.h"
#include "common/job/packet_grid.h"
#include "common/job/sampling_plan.h"

namespace lightmill {

/// kAuto: a pilot chooses the sampling plan.
enum class Integrator : int { kBdpt = 0, kPt = 1, kLt = 2, kAuto = 3 };
const char* integrator_name(Integrator integrator);
/// Inverse. Throws Error(kUsage) for another name.
Integrator integrator_named(const std::string& name);

/// `max_depth` that means "no limit": Russian roulette alone ends paths.
inline constexpr int kUnlimitedDepth = 1 << 20;
/// Largest accepted image, in pixels. Larger ones are refused with one line.
inline constexpr int64_t kMaxPixels = int64_t{1} << 28;
/// Largest accepted side, in pixels.
inline constexpr int kMaxResolution = 65536;

/// Most samples per pixel. A job whose only stop rule is a time or a target error has as many.
inline constexpr int64_t kMaxSpp = int64_t{1} << 31;

/// Largest image whose error after denoising is estimated, pixels: more take too long, 20 s of a processor
/// for a million pixels, and too much memory, 600 bytes a pixel.
inline constexpr int64_t kMaxDenoisedErrorPixels = 2'500'000;

/// Everything that, with the bundle digest, determines a partial's bytes; and the stop rule.
struct RenderSettings {
  Integrator integrator = Integrator::kBdpt;
  FilmGrid grid;
  int64_t spp = 16;   // samples per pixel in total
  int max_depth = 5;  // scattering events (pbrt's meaning); kUnlimitedDepth for no limit
  uint64_t seed = 0;
  double time_s = 0;             // 0: none
  double target_error = 0;       // 0: none
  bool target_denoised = false;  // it is that of the image denoised; wants kAovsToDenoise
  /// Rough metals get back the energy that a single bounce between facets loses. pbrt's images are without.
  bool energy_compensation = false;
  /// The plan in place of the integrator's own. With kAuto: what the pilot chose; empty before.
  std::optional<SamplingPlan> plan = {};
  /// Every pixel gets the same number of camera samples: the pilot makes no sample allocation.
  bool uniform_sampling = false;
  /// Features that are kept although the scene does not need them. Strategies join the plan.
  Features overrides = 0;
  /// Recorded beside the colour, which has the same bits with and without them.
  Aovs aovs = 0;
  /// With kAovLightGroups: the scene's. Else empty.
  LightGroups light_groups = {};
};

/// Whether a pilot has to choose the plan before anything can be rendered.
inline bool needs_pilot(const RenderSettings& settings) {
  return settings.integrator == Integrator::kAuto && !settings.plan;
}
/// The plan that runs. pt: hit and next-event; lt: light-tracing; bdpt, and auto before its pilot: all, with
/// one light path per camera path. With no scattering event only strategies that need none are left, of which
/// one suffices.
SamplingPlan plan_of(const RenderSettings& settings);
inline Strategies strategies_of(const RenderSettings& settings) { return plan_of(settings).strategies; }
/// The plan for people: "pt"; "auto" before its pilot, "auto: hit,next-event,light-tracing × 0.5" after it.
std::string sampling_text(const RenderSettings& settings);
/// Whether partials have a camera layer. AOVs need camera paths even where the colour comes from splats
/// alone.
inline bool has_camera_layer(const RenderSettings& settings) {
  return settings.aovs || (strategies_of(settings) & kCameraLayer);
}
/// Whether partials have splats.
inline bool has_splat_layer(const RenderSettings& settings) {
  return strategies_of(settings) & kLightTracing;
}

/// Throws Error(kind) unless the sides of an image are within the limits.
void check_resolution(int64_t width, int64_t height, ErrorKind kind);
/// Throws Error(kind) if a value is out of its range.
void check_settings(const RenderSettings& settings, ErrorKind kind);

/// Canonical JSON (sorted keys), the form that is stored and sent.
std::string settings_to_json(const RenderSettings& settings);
/// Inverse of settings_to_json; throws Error(kUsage) on malformed input or values out of range.
RenderSettings settings_from_json(const std::string& json);

}  // namespace lightmill
