#include "common/job/settings.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/error.h"
#include "common/base/json/json_aliases.h"
#include "common/base/json/json_depth.h"
#include "common/base/json/json_text.h"
#include "common/job/plan_text.h"

namespace lightmill {
namespace {

[[noreturn]] void usage(const std::string& message) { throw Error(ErrorKind::kUsage, message); }

}  // namespace

void check_resolution(int64_t width, int64_t height, ErrorKind kind) {
  const std::string size = std::to_string(width) + "x" + std::to_string(height);
  if (width < 1 || height < 1)
    throw Error(kind, "resolution " + size + " is empty; both sides must be at least 1");
  if (width > kMaxResolution || height > kMaxResolution || width * height > kMaxPixels) {
    throw Error(kind, "resolution " + size + " is over the limit of " + std::to_string(kMaxResolution) +
                          " a side and " + std::to_string(kMaxPixels) + " pixels; lower it");
  }
}

void check_settings(const RenderSettings& s, ErrorKind kind) {
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
  if (s.target_denoised && (s.aovs & kAovsToDenoise) != kAovsToDenoise)
    throw Error(kind, "a target error of the denoised image wants --aov denoise");
  if (s.target_denoised && c.area() > kMaxDenoisedErrorPixels) {
    throw Error(kind, "a target error of the denoised image is for at most " +
                          std::to_string(kMaxDenoisedErrorPixels) + " pixels");
  }
  if (c.empty() || c.x0 < 0 || c.y0 < 0 || c.x1 > s.grid.width || c.y1 > s.grid.height) {
    throw Error(kind, "the crop window must not be empty and must lie inside the film");
  }
  if (s.plan) check_allocation(s.plan->allocation, s.grid);
  if (!valid_light_groups(s.light_groups) || (!s.light_groups.empty() && !(s.aovs & kAovLightGroups)))
    throw Error(kind, "unknown light groups");
}

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

Integrator integrator_named(const std::string& name) {
  if (name == "bdpt") return Integrator::kBdpt;
  if (name == "pt") return Integrator::kPt;
  if (name == "lt") return Integrator::kLt;
  if (name == "auto") return Integrator::kAuto;
  usage("unknown integrator \"" + name + "\"; use auto, bdpt, pt, lt or scene");
}

SamplingPlan plan_of(const RenderSettings& s) {
  SamplingPlan plan;
  if (s.integrator == Integrator::kPt) plan.strategies = kEmissionHits | kNextEvent;
  if (s.integrator == Integrator::kLt) plan.strategies = kLightTracing;
  if (s.plan) plan = *s.plan;
  plan.strategies |= s.overrides & kAllStrategies;
  if (s.max_depth < 1) {
    for (const Strategies one : {kEmissionHits, kLightTracing}) {
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

std::string settings_to_json(const RenderSettings& s) {
  const PixelRect& c = s.grid.crop;
  JsonText text;  // in the order of the keys
  if (s.aovs) text.add("aovs", aov_names(s.aovs));
  text.add_raw("crop", '[' + std::to_string(c.x0) + ',' + std::to_string(c.y0) + ',' + std::to_string(c.x1) +
                           ',' + std::to_string(c.y1) + ']');
  text.add("energy_compensation", s.energy_compensation);
  text.add("height", s.grid.height);
  text.add("integrator", integrator_name(s.integrator));
  text.add("interleaved", s.grid.interleaved);
  if (!s.light_groups.empty()) text.add("light_groups", light_groups_text(s.light_groups));
  text.add("max_depth", s.max_depth);
  text.add("overrides", feature_names(s.overrides));
  text.add_raw("plan", s.plan ? plan_to_json(*s.plan) : "null");
  text.add("seed", s.seed);
  text.add("spp", s.spp);
  if (s.target_denoised) text.add("target_denoised", true);
  text.add("target_error", s.target_error);
  text.add("time_s", s.time_s);
  text.add("uniform_sampling", s.uniform_sampling);
  text.add("width", s.grid.width);
  return text.end();
}

namespace {

constexpr int kMaxJsonDepth = 8;
constexpr size_t kMaxJsonBytes = 1 << 20;

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
    if (text.size() > kMaxJsonBytes) usage("render settings: larger than 1 MiB");
    check_json_depth(text, kMaxJsonDepth);
    auto j = nlohmann::json::parse(text);
    take_older_keys(&j);
    // Jobs of early versions lack some.
    const bool knows_uniform_sampling = j.contains("uniform_sampling"),
               knows_interleaved = j.contains("interleaved");
    if (j.size() != 12u + knows_uniform_sampling + knows_interleaved + j.contains("aovs") +
                        j.contains("light_groups") + j.contains("target_denoised"))
      usage(
          "render settings: exactly 14 fields are expected, and aovs, light groups and target_denoised where "
          "there are some");
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
    s.target_denoised = j.contains("target_denoised") && j.at("target_denoised").get<bool>();
    s.energy_compensation = j.at("energy_compensation").get<bool>();
    s.grid.interleaved = knows_interleaved && j.at("interleaved").get<bool>();
    s.uniform_sampling = !knows_uniform_sampling || j.at("uniform_sampling").get<bool>();
    s.overrides = features_named(j.at("overrides").get<std::string>());
    if (j.contains("aovs")) s.aovs = aovs_named(j.at("aovs").get<std::string>());
    if (j.contains("light_groups"))
      s.light_groups = light_groups_of_text(j.at("light_groups").get<std::string>());
    if (!j.at("plan").is_null()) s.plan = plan_from_json(j.at("plan").dump());
    check_settings(s, ErrorKind::kUsage);
    return s;
  } catch (const nlohmann::json::exception& e) {
    usage(std::string("render settings are malformed: ") + e.what());
  }
}

}  // namespace lightmill
