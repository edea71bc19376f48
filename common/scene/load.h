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
#include "common/scene/file_source.h"

namespace lightmill {

struct LoadOptions {
  bool strict = false;  // warnings are errors
  // What glTF files may lack; a .pbrt file says it itself.
  std::string camera = {};  // name of the camera to use; empty: the first
  std::string environment =
      {};           // lat-long image that lights the scene, as a FileSource knows it; empty: none
  int threads = 0;  // that read meshes; 0: one per processor. What is read and reported does not depend on it
  // Textures and light images that are not there are rendered as one grey, with a warning.
  bool missing_textures = false;
  // A scene without lights is black; otherwise it gets an even white sky, with a warning.
  bool strict_lights = false;
  PoseChoice pose = {};  // of glTF files
  // Of all shapes of a .pbrt file that are tessellated from few numbers: a small file can't fill the memory.
  size_t most_generated_triangles = 32'000'000;
};

struct LoadResult {
  SceneDescription scene;         // complete only if ok()
  std::vector<Problem> problems;  // in file order
  bool ok() const;
};

/// Reads the scene file `name` through `files` (by extension: .pbrt, .pbrt.gz, .gltf, .glb). Never throws on
/// bad input: every problem is listed. Reading goes on after an error so that `check` can list all of them.
LoadResult load_scene(const std::string& name, const FileSource& files, const LoadOptions& options = {});

/// Convenience for a scene on disk: throws Error(kBadScene) with the first error (one line, "and N more");
/// warnings are passed to `warn`.
SceneDescription load_scene_file(const std::string& path, const LoadOptions& options,
                                 const std::function<void(const Problem&)>& warn, const PathMap& map = {});

/// "file:line:column: message", as every program prints it.
std::string format_problem(const Problem& problem);

}  // namespace lightmill
