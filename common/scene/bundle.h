#pragma once
// Scene bundles: a scene's files, each named by its SHA-256. The bundle's digest names the scene.
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/scene/load.h"

namespace lightmill {

struct BundleEntry {
  std::string name;    // as the scene references it
  std::string digest;  // SHA-256 of the content
  uint64_t size = 0;
  bool operator==(const BundleEntry&) const = default;
};

/// The manifest. `entries` are sorted by name; `main` is one of them, and so is `environment` unless it is
/// empty.
struct Bundle {
  std::string main;
  std::string camera, environment;  // as in LoadOptions
  std::vector<BundleEntry> entries;
  bool missing_textures = false, strict_lights = false;  // as in LoadOptions
  PoseChoice pose = {};                                  // likewise
  /// SHA-256 of the canonical text of the manifest.
  std::string digest() const;
};

/// What the scene is to be loaded with.
LoadOptions load_options(const Bundle& bundle);

/// Canonical text, and back (throws Error(kFailed) on malformed, unsorted or unsafe input).
std::string bundle_to_json(const Bundle& bundle);
Bundle bundle_from_json(const std::string& text);

/// Hashes every file of a loaded scene. `paths` receives digest -> a path that holds it.
Bundle make_bundle(const SceneDescription& scene, std::map<std::string, std::string>* paths);

/// File name of a blob inside a blob folder: digest plus the original's extension (image readers go by it).
std::string blob_file_name(const BundleEntry& entry);

/// Resolves a bundle's names to blobs in `folder`.
class BundleFiles : public FileSource {
 public:
  BundleFiles(const Bundle& bundle, const std::string& folder);
  using FileSource::resolve;
  std::string resolve(const std::string& name, std::string* how) const override;
  bool has_unused_files() const override { return false; }

 private:
  std::map<std::string, std::string> path_by_name_;
};

}  // namespace lightmill
