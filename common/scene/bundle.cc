#include "common/scene/bundle.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/base/json/json_depth.h"
#include "common/scene/scene_files.h"

namespace lightmill {
namespace {

constexpr size_t kMaxEntries = 1'000'000;
// Of a manifest: what an entry needs, for as many as a message has room for.
constexpr int kMaxDepth = 8;
constexpr size_t kMaxValues = 1'000'000;

[[noreturn]] void fail_bundle(const std::string& what) {
  throw Error(ErrorKind::kFailed, "scene bundle: " + what);
}

/// Throws unless the bundle is one that make_bundle could have made.
void check(const Bundle& bundle) {
  if (bundle.entries.empty() || bundle.entries.size() > kMaxEntries)
    fail_bundle("it must hold from 1 to 1000000 files");
  constexpr size_t kMaxCameraName = 4096;
  if (bundle.camera.size() > kMaxCameraName) fail_bundle("the camera's name is too long");
  const PoseChoice& pose = bundle.pose;
  if (pose.animation.size() > kMaxCameraName) fail_bundle("the animation's name is too long");
  if (!std::isfinite(pose.time.value_or(0)) || !std::isfinite(pose.opens) || !(pose.closes >= pose.opens) ||
      !std::isfinite(pose.closes))
    fail_bundle("its times are not finite, or the shutter closes before it opens");
  bool has_main = false, has_environment = bundle.environment.empty();
  for (size_t i = 0; i < bundle.entries.size(); ++i) {
    const BundleEntry& e = bundle.entries[i];
    if (!is_safe_bundle_name(e.name)) fail_bundle("unsafe file name");
    if (!is_sha256_hex(e.digest)) fail_bundle("malformed digest of " + e.name);
    if (i > 0 && !(bundle.entries[i - 1].name < e.name))
      fail_bundle("names are not sorted, or one is given twice");
    has_main = has_main || e.name == bundle.main;
    has_environment = has_environment || e.name == bundle.environment;
  }
  if (!has_main) fail_bundle("its main file is not among its files");
  if (!has_environment) fail_bundle("its environment is not among its files");
}

nlohmann::json pose_to_json(const PoseChoice& pose) {
  auto j = nlohmann::json::object();
  if (!pose.animation.empty()) j["animation"] = pose.animation;
  if (pose.time) j["time"] = *pose.time;
  if (pose.opens != 0 || pose.closes != 0) j["shutter"] = {pose.opens, pose.closes};
  return j;
}
PoseChoice pose_from_json(const nlohmann::json& j) {
  PoseChoice pose;
  pose.animation = j.value("animation", "");
  if (j.contains("time")) pose.time = j.at("time").get<double>();
  if (j.contains("shutter")) {
    pose.opens = j.at("shutter").at(0).get<double>();
    pose.closes = j.at("shutter").at(1).get<double>();
  }
  return pose;
}

}  // namespace

std::string Bundle::digest() const { return sha256_hex(bundle_to_json(*this)); }

std::string bundle_to_json(const Bundle& bundle) {
  auto entries = nlohmann::json::array();
  for (const BundleEntry& e : bundle.entries) {
    entries.push_back({{"digest", e.digest}, {"name", e.name}, {"size", e.size}});
  }
  nlohmann::json j{{"entries", std::move(entries)}, {"main", bundle.main}, {"version", 1}};
  if (!bundle.camera.empty()) j["camera"] = bundle.camera;
  if (!bundle.environment.empty()) j["environment"] = bundle.environment;
  if (bundle.missing_textures) j["missing_textures"] = true;
  if (bundle.strict_lights) j["strict_lights"] = true;
  if (bundle.pose.is_given()) j["pose"] = pose_to_json(bundle.pose);
  return j.dump();
}

Bundle bundle_from_json(const std::string& text) {
  try {
    check_json_size(text, kMaxDepth, kMaxValues);
    const auto j = nlohmann::json::parse(text);
    if (j.at("version") != 1) fail_bundle("unknown version; upgrade this program");
    Bundle bundle;
    bundle.main = j.at("main").get<std::string>();
    bundle.camera = j.value("camera", "");
    bundle.environment = j.value("environment", "");
    bundle.missing_textures = j.value("missing_textures", false);
    bundle.strict_lights = j.value("strict_lights", false);
    if (j.contains("pose")) bundle.pose = pose_from_json(j.at("pose"));
    if (!j.at("entries").is_array()) fail_bundle("\"entries\" must be an array");
    for (const auto& e : j.at("entries")) {
      if (!e.at("size").is_number_unsigned()) fail_bundle("a size must be a whole number from 0");
      bundle.entries.push_back(
          {e.at("name").get<std::string>(), e.at("digest").get<std::string>(), e.at("size").get<uint64_t>()});
    }
    check(bundle);
    return bundle;
  } catch (const nlohmann::json::exception& e) {
    fail_bundle(std::string("malformed manifest: ") + e.what());
  }
}

Bundle make_bundle(const SceneDescription& scene, std::map<std::string, std::string>* paths) {
  if (scene.files.empty()) fail_bundle("the scene has no files");
  Bundle bundle;
  bundle.main = scene.files.front().name;
  bundle.camera = scene.chosen_camera;
  bundle.environment = scene.chosen_environment;
  bundle.missing_textures = scene.missing_textures;
  bundle.strict_lights = scene.strict_lights;
  bundle.pose = scene.pose;
  for (const SourceFile& file : scene.files) {
    std::error_code error;
    const uint64_t size = std::filesystem::file_size(file.path, error);
    if (error) fail_bundle("can't read " + file.path + ": " + error.message());
    const std::string digest = sha256_file(file.path);
    bundle.entries.push_back({file.name, digest, size});
    if (paths != nullptr) (*paths)[digest] = file.path;
  }
  std::sort(bundle.entries.begin(), bundle.entries.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  check(bundle);
  return bundle;
}

std::string blob_file_name(const BundleEntry& entry) {
  constexpr size_t kLongestExtension = 16;
  const std::string base = std::filesystem::path(entry.name).filename().string();
  const size_t dot = base.rfind('.');
  if (dot == std::string::npos || base.size() - dot > kLongestExtension) return entry.digest;
  const std::string extension = base.substr(dot);
  const bool plain = std::all_of(extension.begin() + 1, extension.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
  });
  return plain ? entry.digest + extension : entry.digest;
}

BundleFiles::BundleFiles(const Bundle& bundle, const std::string& folder) {
  for (const BundleEntry& e : bundle.entries) {
    path_by_name_[e.name] = (std::filesystem::path(folder) / blob_file_name(e)).string();
  }
}

LoadOptions load_options(const Bundle& bundle) {
  LoadOptions options;
  options.camera = bundle.camera;
  options.environment = bundle.environment;
  options.missing_textures = bundle.missing_textures;
  options.strict_lights = bundle.strict_lights;
  options.pose = bundle.pose;
  return options;
}

std::string BundleFiles::resolve(const std::string& name, std::string*) const {
  auto found = path_by_name_.find(name);  // names of the manifest itself, such as the main file's
  if (found == path_by_name_.end()) found = path_by_name_.find(bundle_name(name));
  return found == path_by_name_.end() ? "" : found->second;
}

}  // namespace lightmill
