#pragma once
// What the parts of the glTF reader share: the document, the scene that is built, files and problems.
//
// Parts throw GltfProblem for what can't be used; `attempt` reports it and goes on, so that one run lists
// all. Units follow the specification: metres, candela, lux and nits; the image is in nits (cd/m^2) per
// channel.
#include <map>
#include <memory>
#include <set>
#include <string>

#include "common/scene/gltf/json.h"
#include "common/scene/load.h"
#include "common/scene/problem_list.h"

namespace lightmill {

struct GltfScene {
  GltfScene(const FileSource& file_source, ProblemList* problem_list)
      : files(file_source), problems(problem_list) {}

  SceneDescription scene;
  const FileSource& files;
  ProblemList* problems;
  std::string name;                       // of the scene file
  std::string json_text;                  // for places
  std::optional<std::string> glb_binary;  // taken by the buffer without a URI

  SourceLocation where(const std::string& pointer) const { return locate_in_json(json_text, pointer, name); }
  /// The same for what is kept in case something is wrong with it: long texts would take too long to walk.
  SourceLocation likely_place(const std::string& pointer) const {
    constexpr size_t kShort = size_t{1} << 18;
    return json_text.size() <= kShort ? where(pointer) : SourceLocation{name, 1, 1};
  }
  /// "/meshes/0: message".
  void error(const GltfProblem& problem);
  void warning(const std::string& pointer, const std::string& message);
  void unsupported(const std::string& pointer, const std::string& what);

  /// Runs `part`; false if it threw a GltfProblem, which is reported.
  template <class Part>
  bool attempt(Part&& part) {
    try {
      part();
      return true;
    } catch (const GltfProblem& problem) {
      error(problem);
      return false;
    }
  }

  /// Path of a referenced file, listed in scene.files; throws GltfProblem at `pointer`.
  std::string open_reference(const std::string& reference, const std::string& pointer);

 private:
  /// Places cost a walk over the text; beyond this many problems nobody reads them.
  static constexpr int kMaxPlaces = 100;
  SourceLocation place_of_problem(const std::string& pointer);

  std::set<std::string> listed_files_;
  int places_ = 0;
};

}  // namespace lightmill
