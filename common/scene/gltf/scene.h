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

#include "common/scene/gltf/json/json.h"
#include "common/scene/load.h"
#include "common/scene/problem_list.h"

namespace lightmill {

struct GltfScene {
  GltfScene(const FileSource& file_source, ProblemList* problem_list)
      : files(file_source), problems(problem_list) {}

  SceneDescription scene;
  const FileSource& files;
  ProblemList* problems;
  bool missing_textures = false;          // as in LoadOptions
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
  /// Problems that differ by numbers only are of one kind, and each kind is said once, by say_kinds().
  void warning(const std::string& pointer, const std::string& message);
  /// Something a little wrong, which was put right or left out. A warning.
  void mended(const std::string& pointer, const std::string& message);
  void unsupported(const std::string& pointer, const std::string& what);
  /// Reports the kinds of warnings: "/meshes/3: message, and 41 more like it".
  void say_kinds();

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
  /// The same for something that the picture can do without: what is wrong with it is a warning.
  template <class Part>
  bool attempt_optional(Part&& part) {
    try {
      part();
      return true;
    } catch (const GltfProblem& problem) {
      mended(problem.pointer, problem.message + "; it is left out");
      return false;
    }
  }

  /// While there is one, what is wrong is not noted.
  class Quiet {
   public:
    explicit Quiet(GltfScene& scene) : scene_(scene) { ++scene_.quiet_; }
    ~Quiet() { --scene_.quiet_; }
    Quiet(const Quiet&) = delete;
    Quiet& operator=(const Quiet&) = delete;

   private:
    GltfScene& scene_;
  };

  /// Path of a referenced file, listed in scene.files; throws GltfProblem at `pointer`.
  std::string open_reference(const std::string& reference, const std::string& pointer);

 private:
  /// Places cost a walk over the text; beyond this many problems nobody reads them.
  static constexpr int kMaxPlaces = 100;
  SourceLocation place_of_problem(const std::string& pointer);

  enum class Gravity { kWarning, kUnsupported };
  struct Kind {
    Gravity gravity;
    std::string pointer, message;  // of the first
    size_t count = 0;
  };
  void note(Gravity gravity, const std::string& pointer, const std::string& message);

  std::vector<Kind> kinds_;
  std::map<std::string, size_t> kind_of_;
  std::set<std::string> listed_files_;
  int places_ = 0, quiet_ = 0;
};

}  // namespace lightmill
