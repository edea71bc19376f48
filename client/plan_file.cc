#include "client/plan_file.h"

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/base/error.h"
#include "common/base/json/json_depth.h"
#include "common/image/image.h"
#include "common/job/pilot_report.h"
#include "common/job/settings.h"

namespace lightmill::client {
namespace {

constexpr size_t kMaxFileBytes = size_t{4} << 20;  // a job's record with its pilot's report
constexpr int kMaxDepth = 32;

std::string read_text(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::string text(kMaxFileBytes + 1, '\0');
  if (!in || std::filesystem::is_directory(path)) throw Error(ErrorKind::kFailed, path + ": cannot be read");
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<size_t>(in.gcount()));
  if (text.size() > kMaxFileBytes)
    throw Error(ErrorKind::kUsage, path + ": it is larger than 4 MiB; give a plan.json");
  return text;
}

SamplingPlan plan_of_record(const nlohmann::json& settings) {
  const RenderSettings record = settings_from_json(settings.dump());
  if (needs_pilot(record)) throw Error(ErrorKind::kUsage, "the pilot of this job has not chosen a plan yet");
  return plan_of(record);
}

SamplingPlan plan_in(const std::string& text) {
  check_json_depth(text, kMaxDepth);
  const auto j = nlohmann::json::parse(text, nullptr, false);
  if (j.is_object() && j.contains("strategies")) return plan_from_json(text);
  if (j.is_object() && j.contains("chosen")) return pilot_from_json(text).chosen;
  if (j.is_object() && j.contains("settings")) return plan_of_record(j.at("settings"));
  throw Error(ErrorKind::kUsage,
              "it holds no sampling plan; give a plan.json, a job's --json or an .exr image");
}

}  // namespace

SamplingPlan read_plan(const std::string& path) {
  const bool image = std::filesystem::path(path).extension() == ".exr";
  const std::string text = image ? read_image_metadata(path, "plan") : read_text(path);
  if (image && text.empty()) throw Error(ErrorKind::kUsage, path + ": its metadata hold no sampling plan");
  try {
    return plan_in(text);
  } catch (const Error& e) {
    throw Error(ErrorKind::kUsage, path + ": " + e.what());
  }
}

}  // namespace lightmill::client
