#include "common/scene/gltf/scene.h"

#include "common/scene/scene_files.h"

namespace lightmill {

SourceLocation GltfScene::place_of_problem(const std::string& pointer) {
  return ++places_ > kMaxPlaces ? SourceLocation{name, 1, 1} : where(pointer);
}

namespace {
std::string at_pointer(const std::string& pointer, const std::string& message) {
  return pointer.empty() ? message : pointer + ": " + message;
}
}  // namespace

void GltfScene::error(const GltfProblem& problem) {
  problems->error(place_of_problem(problem.pointer), at_pointer(problem.pointer, problem.message));
}

void GltfScene::warning(const std::string& pointer, const std::string& message) {
  problems->warning(place_of_problem(pointer), at_pointer(pointer, message));
}

void GltfScene::unsupported(const std::string& pointer, const std::string& what) {
  problems->unsupported(place_of_problem(pointer), at_pointer(pointer, what));
}

std::string GltfScene::open_reference(const std::string& reference, const std::string& pointer) {
  std::string path = files.resolve(reference);
  if (path.empty()) {
    throw GltfProblem{pointer,
                      "there is no file " + in_quotes(reference) + "; names are relative to the scene file"};
  }
  if (const std::string why = why_unreadable(path); !why.empty())
    throw GltfProblem{pointer, "can't read the file " + in_quotes(reference) + ": " + why};
  const std::string known_as = bundle_name(reference);
  if (listed_files_.insert(known_as).second) scene.files.push_back({known_as, path});
  return path;
}

}  // namespace lightmill
