#include "common/scene/load.h"

#include <algorithm>
#include <filesystem>

#include "common/base/error.h"
#include "common/base/lower_case.h"
#include "common/scene/gltf/reader.h"
#include "common/scene/pbrt/parser.h"

namespace lightmill {

bool LoadResult::ok() const {
  return std::none_of(problems.begin(), problems.end(),
                      [](const Problem& p) { return p.severity == Severity::kError; });
}

LoadResult load_scene(const std::string& name, const FileSource& files, const LoadOptions& options) {
  ProblemList problems(options.strict);
  LoadResult result;
  std::filesystem::path file(name);
  if (lower_case(file.extension().string()) == ".gz") file = file.stem();
  const std::string extension = lower_case(file.extension().string());
  if (extension == ".pbrt") {
    if (!options.camera.empty())
      problems.error({name, 1, 1}, "--camera is for glTF scenes; a .pbrt file has one camera");
    if (!options.environment.empty())
      problems.error({name, 1, 1}, "--environment is for glTF scenes; a .pbrt file lists its lights");
    if (options.pose.is_given())
      problems.error({name, 1, 1},
                     "--time-of, --animation and --shutter are for glTF scenes; a .pbrt file says "
                     "itself what moves");
    try {
      result.scene = PbrtParser(files, &problems, options).parse(name);
    } catch (const std::bad_alloc&) {
      problems.error({name, 1, 1}, "the scene does not fit into memory");
    }
  } else if (extension == ".gltf" || extension == ".glb") {
    try {
      result.scene = read_gltf(name, files, options, &problems);
    } catch (const std::bad_alloc&) {
      problems.error({name, 1, 1}, "the scene does not fit into memory");
    }
  } else {
    problems.error({name, 1, 1}, "a scene file ends in .pbrt, .gltf or .glb, not " + in_quotes(extension));
  }
  name_parts(&result.scene);
  result.scene.missing_textures = options.missing_textures;
  result.scene.strict_lights = options.strict_lights;
  result.scene.pose = options.pose;
  result.problems = problems.take();
  return result;
}

SceneDescription load_scene_file(const std::string& path, const LoadOptions& options,
                                 const std::function<void(const Problem&)>& warn, const PathMap& map) {
  const std::filesystem::path file(path);
  const std::string folder = file.has_parent_path() ? file.parent_path().string() : ".";
  LoadResult result = load_scene(file.filename().string(), DirectoryFiles(folder, map), options);
  const Problem* first = nullptr;
  size_t errors = 0;
  for (const Problem& p : result.problems) {
    if (p.severity == Severity::kWarning) {
      if (warn) warn(p);
    } else if (++errors == 1) {
      first = &p;
    }
  }
  if (first != nullptr) {
    throw Error(
        ErrorKind::kBadScene,
        format_problem(*first) + (errors > 1 ? " (and " + std::to_string(errors - 1) + " more)" : ""));
  }
  return std::move(result.scene);
}

std::string format_problem(const Problem& problem) {
  return problem.where.file + ":" + std::to_string(problem.where.line) + ":" +
         std::to_string(problem.where.column) + ": " +
         (problem.severity == Severity::kWarning ? "warning: " : "") + problem.message;
}

}  // namespace lightmill
