#include "common/settings.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/json_depth.h"
#include "common/json_text.h"
#include "common/plan_text.h"
#include "common/scene/description.h"
#include "common/scene/possible_strategies.h"

namespace lightmill {
namespace {

[[noreturn]] void usage(const std::string& message) { throw Error(ErrorKind::kUsage, message); }

void check_resolution(int64_t width, int64_t height, ErrorKind kind) {
  const std::string size = std::to_string(width) + "x" + std::to_string(height);
  if (width < 1 || height < 1)
    throw Error(kind, "resolution " + size + " is empty; both sides must be at least 1");
  if (width > kMaxResolution || height > kMaxResolution || width * height > kMaxPixels) {
    throw Error(kind, "resolution " + size + " is over the limit of " + std::to_string(kMaxResolution) +
                          " a side and " + std::to_string(kMaxPixels) + " pixels; lower it");
  }
}

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

Integrator integrator_named(const std::string& name) {
  if (name == "bdpt") return Integrator::kBdpt;
  if (name == "pt") return Integrator::kPt;
  if (name == "lt") return Integrator::kLt;
  if (name == "auto") return Integrator::kAuto;
  usage("unknown integrator \"" + name + "\"; use auto, bdpt, pt, lt or scene");
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

void check(const RenderSettings& s, ErrorKind kind) {
  check_resolution(s.grid.width, s.grid.height, kind);
  if (s.spp < 1 || s.spp > kMaxSpp) {
    throw Error(kind, "samples per pixel must be from 1 to " + std::to_string(kMaxSpp) + ", not " +
                          std::to_string(s.spp));
  }
  if (s.max_depth < 0 || s.max_depth > kUnlimitedDepth) {
    throw Error(kind, "max depth must be from 0 to " + std::to_string(kUnlimitedDepth) +
                          " or \"unlimited\", not " + std::to_string(s.max_depth));
  }
  if (!std::isfinite(s.time_s) || s.time_s < 0)
    throw Error(kind, "the time limit must be a positive number of seconds");
  if (!std::isfinite(s.target_error) || s.target_error < 0)
    throw Error(kind, "the target error must be a positive number");
  const PixelRect& c = s.grid.crop;
  if (c.empty() || c.x0 < 0 || c.y0 < 0 || c.x1 > s.grid.width || c.y1 > s.grid.height) {
    throw Error(kind, "the crop window must not be empty and must lie inside the film");
  }
  if (s.plan) check_effort(s.plan->effort, s.grid);
  if (s.plan && s.aovs && !s.plan->effort.uniform()) throw Error(kind, "AOVs need uniform effort");
}

}  // namespace

const char* integrator_name(Integrator integrator) {
  switch (integrator) {
    case Integrator::kBdpt:
      return "bdpt";
    case Integrator::kPt:
      return "pt";
    case Integrator::kLt:
      return "lt";
    case Integrator::kAuto:
      return "auto";
  }
  return "bdpt";
}

SamplingPlan plan_of(const RenderSettings& s) {
  SamplingPlan plan;
  if (s.integrator == Integrator::kPt) plan.strategies = kEmissionHits | kNextEvent;
  if (s.integrator == Integrator::kLt) plan.strategies = kLensConnections;
  if (s.plan) plan = *s.plan;
  plan.strategies |= s.overrides & kAllStrategies;
  if (s.max_depth < 1) {
    for (const Strategies one : {kEmissionHits, kLensConnections}) {
      if (plan.strategies & one) {
        plan.strategies = one;
        break;
      }
    }
  }
  return plan;
}

std::string sampling_text(const RenderSettings& s) {
  std::string text = integrator_name(s.integrator);
  if (s.plan) text.append(": ").append(plan_text(*s.plan));
  return text;
}

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
  if (options.strategies || options.light_paths || options.connections || options.lens_weight) {
    if (!s.plan) s.plan = plan_of(s);
    if (options.strategies) s.plan->strategies = strategies_named(*options.strategies);
    if (options.light_paths) s.plan->light_paths = *options.light_paths;
    if (options.connections) s.plan->connections = *options.connections;
    if (options.lens_weight) s.plan->lens_weight = *options.lens_weight;
  }
  if (options.overrides) s.overrides = features_named(*options.overrides);
  s.uniform_effort = options.uniform_effort;
  s.aovs = options.aovs ? aovs_named(*options.aovs) : scene.film.aovs;
  // AOVs are means over samples that all count the same.
  if (s.aovs) s.uniform_effort = true;
  if (s.plan && s.uniform_effort) s.plan->effort = {};
  leave_out_impossible(scene, options, &s);
  if (s.plan) check_plan(*s.plan);
  check(s, options.spp || options.max_depth ? ErrorKind::kUsage : ErrorKind::kBadScene);
  return s;
}

std::string settings_to_json(const RenderSettings& s) {
  const PixelRect& c = s.grid.crop;
  JsonText text;  // in the order of the keys
  if (s.aovs) text.add("aovs", aov_names(s.aovs));
  text.add_raw("crop", '[' + std::to_string(c.x0) + ',' + std::to_string(c.y0) + ',' + std::to_string(c.x1) +
                           ',' + std::to_string(c.y1) + ']');
  text.add("energy_compensation", s.energy_compensation);
  text.add("height", s.grid.height);
  text.add("integrator", integrator_name(s.integrator));
  text.add("max_depth", s.max_depth);
  text.add("overrides", feature_names(s.overrides));
  text.add_raw("plan", s.plan ? plan_to_json(*s.plan) : "null");
  text.add("seed", s.seed);
  text.add("spp", s.spp);
  text.add("target_error", s.target_error);
  text.add("time_s", s.time_s);
  text.add("uniform_effort", s.uniform_effort);
  text.add("width", s.grid.width);
  return text.end();
}

namespace {

constexpr int kMaxJsonDepth = 8;

int64_t integer_in(const nlohmann::json& j, int64_t low, int64_t high) {
  if (!j.is_number_integer()) usage("render settings: a whole number is expected");
  if (j.is_number_unsigned() && j.get<uint64_t>() > static_cast<uint64_t>(high))
    usage("render settings: a number is too large");
  const auto v = j.get<int64_t>();
  if (v < low || v > high) usage("render settings: a number is out of range");
  return v;
}

}  // namespace

RenderSettings settings_from_json(const std::string& text) {
  try {
    check_json_depth(text, kMaxJsonDepth);
    const auto j = nlohmann::json::parse(text);
    const bool knows_effort = j.contains("uniform_effort");  // since effort can be adaptive
    if (j.size() != 12u + knows_effort + j.contains("aovs"))
      usage("render settings: exactly 13 fields are expected, and aovs where there are some");
    RenderSettings s;
    s.integrator = integrator_named(j.at("integrator").get<std::string>());
    s.grid.width = static_cast<int>(integer_in(j.at("width"), 1, kMaxResolution));
    s.grid.height = static_cast<int>(integer_in(j.at("height"), 1, kMaxResolution));
    const auto& crop = j.at("crop");
    if (!crop.is_array() || crop.size() != 4) usage("render settings: \"crop\" must hold 4 numbers");
    const auto edge = [&](size_t i) { return static_cast<int>(integer_in(crop.at(i), 0, kMaxResolution)); };
    s.grid.crop = {edge(0), edge(1), edge(2), edge(3)};
    s.spp = integer_in(j.at("spp"), 1, kMaxSpp);
    s.max_depth = static_cast<int>(integer_in(j.at("max_depth"), 0, kUnlimitedDepth));
    if (!j.at("seed").is_number_unsigned()) usage("render settings: \"seed\" must be a whole number from 0");
    s.seed = j.at("seed").get<uint64_t>();
    s.time_s = j.at("time_s").get<double>();
    s.target_error = j.at("target_error").get<double>();
    s.energy_compensation = j.at("energy_compensation").get<bool>();
    s.uniform_effort = !knows_effort || j.at("uniform_effort").get<bool>();
    s.overrides = features_named(j.at("overrides").get<std::string>());
    if (j.contains("aovs")) s.aovs = aovs_named(j.at("aovs").get<std::string>());
    if (!j.at("plan").is_null()) s.plan = plan_from_json(j.at("plan").dump());
    check(s, ErrorKind::kUsage);
    return s;
  } catch (const nlohmann::json::exception& e) {
    usage(std::string("render settings are malformed: ") + e.what());
  }
}

}  // namespace lightmill
