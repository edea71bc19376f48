#include "coordinator/web/scene_submit.h"

#include <algorithm>
#include <filesystem>

#include "coordinator/web/fields.h"

namespace lightmill {
namespace {

using nlohmann::json;

constexpr int64_t kMaxMaxWorkers = 100000;

int as_int(int64_t value) { return static_cast<int>(value); }

/// What the scene is read with.
SceneQuestion question_of(Fields& fields) {
  SceneQuestion question;
  question.files.main = fields.text("main").value_or("");
  question.files.camera = fields.text("camera").value_or("");
  question.files.environment = fields.text("environment").value_or("");
  question.strict = fields.flag("strict").value_or(false);
  for (const json& file : fields.array("files")) {
    Fields entry(file);
    question.files.entries.push_back(
        {entry.text("name").value_or(""), entry.text("digest").value_or(""),
         static_cast<uint64_t>(entry.integer("size", 0, INT64_MAX).value_or(0))});
    entry.end();
  }
  std::sort(question.files.entries.begin(), question.files.entries.end(),
            [](const BundleEntry& a, const BundleEntry& b) { return a.name < b.name; });
  try {
    bundle_from_json(bundle_to_json(question.files));  // checks the names
  } catch (const Error& e) {
    throw Error(ErrorKind::kUsage, e.what());
  }
  RenderOptions& options = question.options;
  options.integrator = fields.text("integrator").value_or(options.integrator);
  options.spp = fields.integer("spp", 1, kMaxSpp);
  options.time_s = fields.number("time_seconds");
  options.target_error = fields.number("target_error");
  if (const auto depth = fields.integer("max_depth", 0, kUnlimitedDepth))
    options.max_depth = *depth == 0 ? kUnlimitedDepth : as_int(*depth);
  if (const auto seed = fields.integer("seed", 0, INT64_MAX)) options.seed = static_cast<uint64_t>(*seed);
  if (const auto width = fields.integer("width", 1, kMaxResolution)) options.width = as_int(*width);
  if (const auto height = fields.integer("height", 1, kMaxResolution)) options.height = as_int(*height);
  options.aovs = fields.text("aovs");
  return question;
}

/// What does not concern how it is read.
JobRequest job_of(Fields& fields, const SceneQuestion& question) {
  JobRequest job;
  job.name = fields.text("name").value_or(std::filesystem::path(question.files.main).stem().string());
  job.pool = fields.text("pool").value_or("");
  job.priority = as_int(fields.integer("priority", -kMaxPriority, kMaxPriority).value_or(0));
  job.max_workers = as_int(fields.integer("max_workers", 0, kMaxMaxWorkers).value_or(0));
  fields.end();
  return job;
}

SceneAnswer read(const WebOptions& web, SceneQuestion* question) {
  JobRequest bounded;  // nothing is read that could not be submitted
  bounded.bundle = question->files;
  check_quotas(web.quotas, bounded);
  for (const BundleEntry& entry : question->files.entries) {
    if (!web.blobs.contains(entry.digest))
      throw Error(ErrorKind::kFailed, "file " + entry.name + " was not uploaded");
    if (web.blobs.size(entry.digest) != entry.size)
      throw Error(ErrorKind::kUsage, "file " + entry.name + " has another size than it says");
    question->paths.push_back(web.blobs.path(entry.digest));
  }
  if (!web.read_scene)
    throw Error(ErrorKind::kFailed, "this coordinator reads no scenes; submit it by lightmill submit");
  return web.read_scene(*question);
}

}  // namespace

json check_scene(const WebOptions& web, const std::string& body) {
  Fields fields(body);
  SceneQuestion question = question_of(fields);
  job_of(fields, question);
  const SceneAnswer answer = read(web, &question);
  auto missing = json::array();
  for (const SceneAnswer::Missing& file : answer.missing)
    missing.push_back({{"reference", file.reference}, {"name", file.name}});
  json view{{"errors", answer.errors}, {"warnings", answer.warnings}, {"missing", std::move(missing)}};
  if (!answer.errors.empty()) return view;
  uint64_t bytes = 0;
  for (const BundleEntry& entry : answer.bundle.entries) bytes += entry.size;
  view["files"] = answer.bundle.entries.size();
  view["bytes"] = bytes;
  view["width"] = answer.settings.grid.crop.width();
  view["height"] = answer.settings.grid.crop.height();
  if (answer.settings.spp < kMaxSpp) view["spp"] = answer.settings.spp;
  view["max_depth"] = answer.settings.max_depth == kUnlimitedDepth ? 0 : answer.settings.max_depth;
  return view;
}

JobId submit_scene(const WebOptions& web, const std::string& body, const std::string& user) {
  Fields fields(body);
  SceneQuestion question = question_of(fields);
  JobRequest job = job_of(fields, question);
  const SceneAnswer answer = read(web, &question);
  if (!answer.errors.empty()) {
    const size_t more = answer.errors.size() - 1;
    throw Error(ErrorKind::kBadScene,
                answer.errors.front() + (more > 0 ? " (and " + std::to_string(more) + " more)" : ""));
  }
  job.bundle = answer.bundle;
  job.settings = answer.settings;
  job.submitter = user;
  check_quotas(web.quotas, job);
  const std::string refusal = web.submissions ? web.submissions->refusal(user) : "";
  if (!refusal.empty()) throw LimitReached(refusal);
  return web.farm.submit(job);
}

}  // namespace lightmill
