#pragma once
// Loading a scene file, from a folder or from a bundle.
//
//   LoadResult r = load_scene("scene.pbrt", DirectoryFiles("."), {});
//   if (!r.ok()) ... r.problems
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/scene/description.h"

namespace lightmill {

/// Where a scene's files are found. The seam between "a folder" and "blobs of a bundle".
class FileSource {
 public:
  virtual ~FileSource() = default;
  /// Path that can be opened for the file named `name` (relative to the main scene file's folder, or
  /// absolute), or empty if there is none.
  virtual std::string resolve(const std::string& name) const = 0;
  /// False where images of textures and meshes of objects may be absent that nothing in the scene shows, as
  /// in a bundle.
  virtual bool has_unused_files() const { return true; }
};

/// Files relative to the folder of the main scene file.
class DirectoryFiles : public FileSource {
 public:
  explicit DirectoryFiles(std::string folder) : folder_(std::move(folder)) {}
  std::string resolve(const std::string& name) const override;

 private:
  std::string folder_;
};

struct LoadOptions {
  bool strict = false;  // unsupported features are errors
  // What glTF files may lack; a .pbrt file says it itself.
  std::string camera = {};  // name of the camera to use; empty: the first
  std::string environment =
      {};           // lat-long image that lights the scene, as a FileSource knows it; empty: none
  int threads = 0;  // that read meshes; 0: one per processor. What is read and reported does not depend on it
  // Of all shapes of a .pbrt file that are tessellated from few numbers: a small file can't fill the memory.
  size_t most_generated_triangles = 32'000'000;
};

struct LoadResult {
  SceneDescription scene;         // complete only if ok()
  std::vector<Problem> problems;  // in file order
  bool ok() const;
};

/// Reads the scene file `name` through `files` (by extension: .pbrt, .gltf, .glb). Never throws on bad input:
/// every problem is listed. Reading goes on after an error so that `check` can list all of them.
LoadResult load_scene(const std::string& name, const FileSource& files, const LoadOptions& options = {});

/// Convenience for a scene on disk: throws Error(kBadScene) with the first error (one line, "and N more");
/// warnings are passed to `warn`.
SceneDescription load_scene_file(const std::string& path, const LoadOptions& options,
                                 const std::function<void(const Problem&)>& warn);

/// "file:line:column: message", as every program prints it.
std::string format_problem(const Problem& problem);

}  // namespace lightmill
