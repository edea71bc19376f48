#include <nlohmann/json.hpp>
#include <set>

#include "common/base/error.h"
#include "coordinator/scene/scene_reader.h"

namespace lightmill {
namespace {

using nlohmann::json;

template <class T>
void put(json* object, const char* key, const std::optional<T>& value) {
  if (value) (*object)[key] = *value;
}

template <class T>
void take(const json& object, const char* key, std::optional<T>* value) {
  if (object.contains(key)) *value = object.at(key).get<T>();
}

/// What a form offers of the options.
json options_to_json(const RenderOptions& o) {
  json object{{"integrator", o.integrator}};
  put(&object, "spp", o.spp);
  put(&object, "time_s", o.time_s);
  put(&object, "target_error", o.target_error);
  put(&object, "max_depth", o.max_depth);
  put(&object, "seed", o.seed);
  put(&object, "width", o.width);
  put(&object, "height", o.height);
  put(&object, "crop", o.crop);
  put(&object, "aovs", o.aovs);
  put(&object, "overrides", o.overrides);
  object["target_denoised"] = o.target_denoised;
  object["uniform_sampling"] = o.uniform_sampling;
  object["energy_compensation"] = o.energy_compensation;
  return object;
}

RenderOptions options_from_json(const json& object) {
  RenderOptions o;
  o.integrator = object.at("integrator").get<std::string>();
  take(object, "spp", &o.spp);
  take(object, "time_s", &o.time_s);
  take(object, "target_error", &o.target_error);
  take(object, "max_depth", &o.max_depth);
  take(object, "seed", &o.seed);
  take(object, "width", &o.width);
  take(object, "height", &o.height);
  take(object, "crop", &o.crop);
  take(object, "aovs", &o.aovs);
  take(object, "overrides", &o.overrides);
  o.target_denoised = object.at("target_denoised").get<bool>();
  o.uniform_sampling = object.at("uniform_sampling").get<bool>();
  o.energy_compensation = object.at("energy_compensation").get<bool>();
  return o;
}

[[noreturn]] void malformed(const char* what, const std::string& why) {
  throw Error(ErrorKind::kUsage, std::string(what) + " is malformed: " + why);
}

/// Texts of a scene may hold any bytes.
std::string text_of(const json& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); }

}  // namespace

std::string question_to_json(const SceneQuestion& question) {
  return text_of({{"files", bundle_to_json(question.files)},
                  {"paths", question.paths},
                  {"strict", question.strict},
                  {"options", options_to_json(question.options)}});
}

SceneQuestion question_from_json(const std::string& text) {
  try {
    const json object = json::parse(text);
    SceneQuestion question;
    question.files = bundle_from_json(object.at("files").get<std::string>());
    question.paths = object.at("paths").get<std::vector<std::string>>();
    question.strict = object.at("strict").get<bool>();
    question.options = options_from_json(object.at("options"));
    if (question.paths.size() != question.files.entries.size()) malformed("the question", "a path per file");
    return question;
  } catch (const json::exception& e) {
    malformed("the question", e.what());
  }
}

std::string answer_to_json(const SceneAnswer& answer) {
  auto missing = json::array();
  for (const SceneAnswer::Missing& file : answer.missing) missing.push_back({file.reference, file.name});
  json object{{"errors", answer.errors}, {"warnings", answer.warnings}, {"missing", std::move(missing)}};
  if (answer.errors.empty()) {
    auto used = json::array();
    for (const BundleEntry& entry : answer.bundle.entries) used.push_back(entry.name);
    object["used"] = std::move(used);
    object["camera"] = answer.bundle.camera;
    object["environment"] = answer.bundle.environment;
    object["settings"] = settings_to_json(answer.settings);
  }
  return text_of(object);
}

SceneAnswer answer_from_json(const std::string& text, const SceneQuestion& question) {
  try {
    const json object = json::parse(text);
    SceneAnswer answer;
    answer.errors = object.at("errors").get<std::vector<std::string>>();
    answer.warnings = object.at("warnings").get<std::vector<std::string>>();
    for (const json& file : object.at("missing"))
      answer.missing.push_back({file.at(0).get<std::string>(), file.at(1).get<std::string>()});
    if (answer.errors.size() > kMostProblems + 1 || answer.warnings.size() > kMostProblems + 1 ||
        answer.missing.size() > kMostMissing)
      malformed("the answer", "too long");
    if (!answer.errors.empty()) return answer;
    const auto used = object.at("used").get<std::set<std::string>>();
    answer.bundle = question.files;
    answer.bundle.camera = object.at("camera").get<std::string>();
    answer.bundle.environment = object.at("environment").get<std::string>();
    std::erase_if(answer.bundle.entries, [&](const BundleEntry& e) { return !used.contains(e.name); });
    answer.bundle = bundle_from_json(bundle_to_json(answer.bundle));
    answer.settings = settings_from_json(object.at("settings").get<std::string>());
    return answer;
  } catch (const json::exception& e) {
    malformed("the answer", e.what());
  }
}

}  // namespace lightmill
