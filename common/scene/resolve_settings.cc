#include "common/scene/resolve_settings.h"

#include <cmath>

#include "common/base/error.h"
#include "common/scene/description.h"
#include "common/scene/lights/scene_light_groups.h"
#include "common/scene/possible_strategies.h"

namespace lightmill {
namespace {

[[noreturn]] void usage(const std::string& message) { throw Error(ErrorKind::kUsage, message); }

/// First pixel at or right of a fraction of a side: pbrt's ceil(fraction * side), forgiving the rounding of
/// fractions that stand for whole pixels.
int crop_edge(double fraction, int side) {
  return static_cast<int>(std::ceil(fraction * side - 1e-9 * side));
}

PixelRect crop_rect(const std::array<double, 4>& c, int width, int height, ErrorKind kind) {
  for (double x : c) {
    if (!(x >= 0 && x <= 1)) throw Error(kind, "the crop window must be x0,x1,y0,y1 within [0, 1]");
  }
  if (!(c[0] < c[1] && c[2] < c[3])) throw Error(kind, "the crop window must have x0 < x1 and y0 < y1");
  const PixelRect r{crop_edge(c[0], width), crop_edge(c[2], height), crop_edge(c[1], width),
                    crop_edge(c[3], height)};
  if (r.empty()) {
    throw Error(kind, "the crop window holds no pixel of " + std::to_string(width) + "x" +
                          std::to_string(height) + "; enlarge it");
  }
  return r;
}

/// What a scene's integrator corresponds to here; bidirectional methods and those we lack become bdpt.
Integrator integrator_of_scene(const std::string& name) {
  if (name == "path" || name == "volpath" || name == "simplepath" || name == "simplevolpath" ||
      name == "randomwalk") {
    return Integrator::kPt;
  }
  return name == "lightpath" ? Integrator::kLt : Integrator::kBdpt;
}

/// An integrator's own plan does without what the scene does not allow; what was asked for by its name is
/// refused. The pilot of auto sees to its plan itself.
void leave_out_impossible(const SceneDescription& scene, const RenderOptions& options, RenderSettings* s) {
  const PossibleStrategies possible = possible_strategies(scene);
  Strategies named = s->overrides & kAllStrategies;
  if (options.strategies || options.plan) named |= s->plan->strategies;
  if (named & ~possible.set)
    usage(strategy_names(named & ~possible.set) + ": " + possible.why_no_more + "; leave it out");
  const Strategies wanted = strategies_of(*s), left = wanted & possible.set;
  if (needs_pilot(*s) || left == wanted) return;
  if (!left) {
    throw Error(options.integrator == "scene" ? ErrorKind::kBadScene : ErrorKind::kUsage,
                std::string(integrator_name(s->integrator)) + ": " + possible.why_no_more +
                    "; use another integrator");
  }
  if (!s->plan) s->plan = plan_of(*s);
  s->plan->strategies = left;
}

}  // namespace

RenderSettings resolve_settings(const SceneDescription& scene, const RenderOptions& options) {
  RenderSettings s;
  if (options.integrator == "scene") {
    s.integrator = integrator_of_scene(scene.sampling.integrator);
  } else {
    s.integrator = integrator_named(options.integrator);
  }
  // Options out of range are the command line's fault, everything else the scene's.
  if (options.time_s && !(*options.time_s > 0)) usage("--time must be above 0 seconds");
  if (options.target_error && !(*options.target_error > 0)) usage("--target-error must be above 0");
  const bool own_size = options.width || options.height;
  s.grid.width = options.width.value_or(scene.film.width);
  s.grid.height = options.height.value_or(scene.film.height);
  check_resolution(s.grid.width, s.grid.height, own_size ? ErrorKind::kUsage : ErrorKind::kBadScene);
  // A crop is kept as fractions, so that it frames the same part of the view at any resolution.
  s.grid.crop = {0, 0, s.grid.width, s.grid.height};
  if (options.crop) {
    s.grid.crop = crop_rect(*options.crop, s.grid.width, s.grid.height, ErrorKind::kUsage);
  } else if (scene.film.crop) {
    s.grid.crop = crop_rect(*scene.film.crop, s.grid.width, s.grid.height,
                            own_size ? ErrorKind::kUsage : ErrorKind::kBadScene);
  }
  // --time and --target-error stand instead of a number of samples, unless that is given too.
  s.spp = options.spp.value_or(options.time_s || options.target_error ? kMaxSpp : scene.sampling.spp);
  s.max_depth = options.max_depth.value_or(scene.sampling.max_depth);
  s.seed = options.seed.value_or(scene.sampling.seed);
  s.time_s = options.time_s.value_or(0);
  s.target_error = options.target_error.value_or(0);
  s.energy_compensation = options.energy_compensation;
  s.plan = options.plan;
  if (options.strategies || options.light_paths || options.connections || options.light_tracing_weight ||
      options.rr_depth) {
    if (!s.plan) s.plan = plan_of(s);
    if (options.strategies) s.plan->strategies = strategies_named(*options.strategies);
    if (options.light_paths) s.plan->light_paths = *options.light_paths;
    if (options.connections) s.plan->connections = *options.connections;
    if (options.light_tracing_weight) s.plan->light_tracing_weight = *options.light_tracing_weight;
    if (options.rr_depth) s.plan->rr_depth = *options.rr_depth;
  }
  if (options.overrides) s.overrides = features_named(*options.overrides);
  s.uniform_sampling = options.uniform_sampling;
  s.aovs = options.aovs ? aovs_named(*options.aovs) : scene.film.aovs;
  if (options.denoise || options.target_denoised) s.aovs |= kAovsToDenoise;
  s.target_denoised = options.target_denoised;
  if (s.aovs & kAovLightGroups) s.light_groups = light_groups_of(scene);
  if (s.plan && s.uniform_sampling) s.plan->allocation = {};
  leave_out_impossible(scene, options, &s);
  if (s.plan) check_plan(*s.plan);
  check_settings(s, options.spp || options.max_depth ? ErrorKind::kUsage : ErrorKind::kBadScene);
  return s;
}

}  // namespace lightmill
