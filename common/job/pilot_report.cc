#include "common/job/pilot_report.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/error.h"
#include "common/base/json/json_aliases.h"

namespace lightmill {
namespace {

constexpr size_t kMaxEstimates = 1000, kMaxNotes = 200;

double positive(const nlohmann::json& j) {
  const auto x = j.get<double>();
  if (!std::isfinite(x) || x < 0)
    throw Error(ErrorKind::kUsage, "pilot report: an estimate must be a number from 0");
  return x;
}

constexpr std::pair<const char*, double SampleWork::*> kWork[] = {
    {"camera_hits", &SampleWork::camera_hits},
    {"connection_rays", &SampleWork::connection_rays},
    {"lens_rays", &SampleWork::lens_rays},
    {"light_hits", &SampleWork::light_hits},
    {"next_event_rays", &SampleWork::next_event_rays},
    {"primitives", &SampleWork::primitives}};
/// What older reports do not have.
constexpr std::pair<const char*, double SampleWork::*> kLater[] = {
    {"camera_steps", &SampleWork::camera_steps},
    {"connection_tries", &SampleWork::connection_tries},
    {"lens_tries", &SampleWork::lens_tries},
    {"light_steps", &SampleWork::light_steps},
    {"next_event_tries", &SampleWork::next_event_tries},
    {"splat_pixels", &SampleWork::splat_pixels}};

std::string text_of(const nlohmann::json& j) {
  auto text = j.get<std::string>();
  if (text.size() > kMaxNoteBytes)
    throw Error(ErrorKind::kUsage, "pilot report: a text of more than 2000 bytes");
  return text;
}

std::vector<FeatureNote> features_of(const nlohmann::json& array) {
  if (!array.is_array() || array.size() > kMaxNotes)
    throw Error(ErrorKind::kUsage, "pilot report: \"features\" must be an array of at most 200");
  std::vector<FeatureNote> notes;
  for (const auto& note : array) {
    notes.push_back({text_of(note.at("feature")), note.at("needed").get<bool>(), text_of(note.at("reason")),
                     text_of(note.at("saving"))});
  }
  return notes;
}

std::vector<std::string> lines_of(const nlohmann::json& array) {
  if (!array.is_array() || array.size() > kMaxMissingLight)
    throw Error(ErrorKind::kUsage, "pilot report: \"missing_light\" must be an array of at most 8");
  std::vector<std::string> lines;
  for (const auto& line : array) lines.push_back(text_of(line));
  return lines;
}

}  // namespace

SampleWork& SampleWork::operator+=(const SampleWork& o) {
  for (const auto& [name, member] : kWork) this->*member += o.*member;
  for (const auto& [name, member] : kLater) this->*member += o.*member;
  return *this;
}

SampleWork SampleWork::times(double factor) const {
  SampleWork work;
  for (const auto& [name, member] : kWork) work.*member = this->*member * factor;
  for (const auto& [name, member] : kLater) work.*member = this->*member * factor;
  return work;
}

std::string pilot_to_json(const PilotReport& report) {
  auto estimates = nlohmann::json::array();
  for (const PlanEstimate& e : report.estimates) {
    estimates.push_back({{"plan", nlohmann::json::parse(plan_to_json(e.plan))},
                         {"relative_variance", e.relative_variance},
                         {"cost", e.cost},
                         {"shadow_rays", e.shadow_rays}});
  }
  auto features = nlohmann::json::array();
  for (const FeatureNote& note : report.features) {
    features.push_back({{"feature", note.feature},
                        {"needed", note.needed},
                        {"reason", note.reason},
                        {"saving", note.saving}});
  }
  nlohmann::json work;
  for (const auto& [name, member] : kWork) work[name] = report.work.*member;
  for (const auto& [name, member] : kLater) work[name] = report.work.*member;
  nlohmann::json j{{"chosen", nlohmann::json::parse(plan_to_json(report.chosen))},
                   {"adaptive_gain", report.adaptive_gain},
                   {"estimates", estimates},
                   {"samples", report.samples},
                   {"work", work}};
  if (report.emission_guide_gain != 1) j["emission_guide_gain"] = report.emission_guide_gain;
  if (!features.empty()) j["features"] = std::move(features);
  if (!report.missing_light.empty()) j["missing_light"] = report.missing_light;
  return j.dump();
}

PilotReport pilot_from_json(const std::string& text) {
  if (text.size() > kMaxPilotBytes) throw Error(ErrorKind::kUsage, "pilot report: larger than 1 MiB");
  try {
    auto j = nlohmann::json::parse(text);
    take_older_keys(&j);
    PilotReport report;
    report.chosen = plan_from_json(j.at("chosen").dump());
    report.adaptive_gain = positive(j.at("adaptive_gain"));
    const auto& estimates = j.at("estimates");
    if (!estimates.is_array() || estimates.size() > kMaxEstimates)
      throw Error(ErrorKind::kUsage, "pilot report: \"estimates\" must be an array of at most 1000");
    for (const auto& e : estimates) {
      report.estimates.push_back({plan_from_json(e.at("plan").dump()), positive(e.at("relative_variance")),
                                  positive(e.at("cost")),
                                  e.contains("shadow_rays") ? positive(e.at("shadow_rays")) : 0});
    }
    if (j.contains("emission_guide_gain")) report.emission_guide_gain = positive(j.at("emission_guide_gain"));
    if (j.contains("features")) report.features = features_of(j.at("features"));
    if (j.contains("missing_light")) report.missing_light = lines_of(j.at("missing_light"));
    report.samples = j.at("samples").get<int64_t>();
    if (report.samples < 0) throw Error(ErrorKind::kUsage, "pilot report: \"samples\" must not be negative");
    const auto& work = j.at("work");
    for (const auto& [name, member] : kWork) report.work.*member = positive(work.at(name));
    for (const auto& [name, member] : kLater) {
      if (work.contains(name)) report.work.*member = positive(work.at(name));
    }
    return report;
  } catch (const nlohmann::json::exception& e) {
    throw Error(ErrorKind::kUsage, std::string("the pilot report is malformed: ") + e.what());
  }
}

}  // namespace lightmill
