#include "coordinator/service/scenes/scene_request.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "common/base/utf8.h"
#include "common/rpc/status.h"

namespace lightmill {
namespace {

constexpr int kMaxSceneFiles = 50000;
constexpr int kMostWorkers = 100000;

[[noreturn]] void out_of_range(const char* name, const std::string& range) {
  throw Error(ErrorKind::kUsage, std::string(name) + " must be " + range);
}

template <class T>
T within(const char* name, T value, T least, T most) {
  if (value < least || value > most)
    out_of_range(name, "a whole number from " + std::to_string(least) + " to " + std::to_string(most));
  return value;
}

double from_zero(const char* name, double value) {
  if (!(value >= 0) || !std::isfinite(value)) out_of_range(name, "a number from 0");
  return value;
}

Bundle files_of(const v1::SceneRequest& request) {
  if (request.files_size() > kMaxSceneFiles)
    out_of_range("files", "at most " + std::to_string(kMaxSceneFiles) + " files");
  Bundle files;
  files.main = request.main();
  files.camera = request.camera();
  files.environment = request.environment();
  files.missing_textures = request.missing_textures();
  files.strict_lights = request.strict_lights();
  files.pose.animation = request.animation();
  if (request.has_time_of()) files.pose.time = request.time_of();
  files.pose.opens = request.shutter_opens();
  files.pose.closes = request.shutter_closes();
  for (const v1::SceneFile& file : request.files())
    files.entries.push_back({file.name(), file.digest(), file.size()});
  std::sort(files.entries.begin(), files.entries.end(),
            [](const BundleEntry& a, const BundleEntry& b) { return a.name < b.name; });
  try {
    bundle_from_json(bundle_to_json(files));  // checks the names
  } catch (const Error& e) {
    throw Error(ErrorKind::kUsage, e.what());
  }
  return files;
}

RenderOptions options_of(const v1::SceneRequest& request) {
  RenderOptions options;
  if (!request.integrator().empty()) options.integrator = request.integrator();
  if (request.has_spp()) options.spp = within<int64_t>("spp", request.spp(), 1, kMaxSpp);
  if (request.has_time_seconds()) options.time_s = from_zero("time_seconds", request.time_seconds());
  if (request.has_target_error()) options.target_error = from_zero("target_error", request.target_error());
  options.target_denoised = request.target_denoised();
  if (request.has_max_depth()) {
    const int depth = within<int>("max_depth", request.max_depth(), 0, kUnlimitedDepth);
    options.max_depth = depth == 0 ? kUnlimitedDepth : depth;
  }
  if (request.has_seed())
    options.seed = static_cast<uint64_t>(within<int64_t>("seed", request.seed(), 0, INT64_MAX));
  if (request.has_width()) options.width = within<int>("width", request.width(), 1, kMaxResolution);
  if (request.has_height()) options.height = within<int>("height", request.height(), 1, kMaxResolution);
  if (request.has_crop()) {
    const v1::CropWindow& crop = request.crop();
    options.crop = {crop.x0(), crop.x1(), crop.y0(), crop.y1()};
    for (const double x : *options.crop) {
      if (!(x >= 0 && x <= 1)) out_of_range("crop", "four numbers from 0 to 1");
    }
  }
  if (request.has_aovs()) options.aovs = request.aovs();
  if (request.has_overrides()) options.overrides = request.overrides();
  options.uniform_sampling = request.uniform_sampling();
  options.energy_compensation = request.energy_compensation();
  return options;
}

}  // namespace

SceneJob scene_job_of(const v1::SceneRequest& request) {
  SceneJob scene;
  scene.question.files = files_of(request);
  scene.question.strict = request.strict();
  scene.question.options = options_of(request);
  JobRequest& job = scene.job;
  job.name = request.name().empty() ? std::filesystem::path(request.main()).stem().string() : request.name();
  job.pool = request.pool();
  job.priority = request.priority();
  job.max_workers = within<int>("max_workers", request.max_workers(), 0, kMostWorkers);
  for (const std::string& id : request.after()) job.after.push_back(JobId{id});
  return scene;
}

v1::CheckSceneResponse check_response(const SceneAnswer& answer) {
  v1::CheckSceneResponse response;
  for (const std::string& line : answer.errors) response.add_errors(one_line(line));
  for (const std::string& line : answer.warnings) response.add_warnings(one_line(line));
  for (const SceneAnswer::Missing& file : answer.missing) {
    v1::MissingFile& missing = *response.add_missing();
    missing.set_reference(valid_utf8(file.reference));
    missing.set_name(valid_utf8(file.name));
  }
  if (!answer.errors.empty()) return response;
  uint64_t bytes = 0;
  for (const BundleEntry& entry : answer.bundle.entries) bytes += entry.size;
  response.set_files(static_cast<int64_t>(answer.bundle.entries.size()));
  response.set_bytes(bytes);
  response.set_width(answer.settings.grid.crop.width());
  response.set_height(answer.settings.grid.crop.height());
  if (answer.settings.spp < kMaxSpp) response.set_spp(answer.settings.spp);
  response.set_bundle_json(bundle_to_json(answer.bundle));
  response.set_settings_json(settings_to_json(answer.settings));
  response.set_max_depth(answer.settings.max_depth == kUnlimitedDepth ? 0 : answer.settings.max_depth);
  return response;
}

}  // namespace lightmill
