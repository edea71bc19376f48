#include "coordinator/scene/scene_reader.h"

#include <algorithm>
#include <map>
#include <mutex>
#include <set>

#include "common/base/error.h"
#include "common/scene/load.h"
#include "common/scene/scene_files.h"

namespace lightmill {
namespace {

/// The question's files; takes down what is asked for and not among them.
class Uploaded : public FileSource {
 public:
  explicit Uploaded(const SceneQuestion& question) {
    for (size_t i = 0; i < question.paths.size(); ++i)
      paths_[question.files.entries[i].name] = question.paths[i];
  }
  using FileSource::resolve;
  std::string resolve(const std::string& name, std::string*) const override {
    auto found = paths_.find(name);  // names of the manifest itself, such as the main file's
    const std::string known = bundle_name(name);
    if (found == paths_.end()) found = paths_.find(known);
    if (found != paths_.end()) return found->second;
    const std::lock_guard lock(mutex_);  // meshes are read ahead by other threads
    if (missing_.size() < kMostMissing) missing_.emplace(known, name);
    return "";
  }
  std::vector<SceneAnswer::Missing> missing() const {
    std::vector<SceneAnswer::Missing> list;
    for (const auto& [name, reference] : missing_) {
      if (is_safe_bundle_name(name)) list.push_back({reference, name});
    }
    return list;
  }

 private:
  std::map<std::string, std::string> paths_;
  mutable std::mutex mutex_;
  mutable std::map<std::string, std::string> missing_;  // reference by name
};

void keep_some(std::vector<std::string>* lines) {
  if (lines->size() <= kMostProblems) return;
  const size_t more = lines->size() - kMostProblems;
  lines->resize(kMostProblems);
  lines->push_back("and " + std::to_string(more) + " more");
}

}  // namespace

SceneAnswer read_scene(const SceneQuestion& question) {
  const Uploaded files(question);
  LoadOptions load = load_options(question.files);
  load.strict = question.strict;
  LoadResult result = load_scene(question.files.main, files, load);
  SceneAnswer answer;
  for (const Problem& problem : result.problems) {
    (problem.severity == Severity::kWarning ? answer.warnings : answer.errors)
        .push_back(format_problem(problem));
  }
  answer.missing = files.missing();
  if (answer.errors.empty()) {
    try {
      answer.settings = resolve_settings(result.scene, question.options);
    } catch (const Error& e) {
      if (e.kind() != ErrorKind::kBadScene) throw;
      answer.errors.emplace_back(e.what());
    }
  }
  keep_some(&answer.errors);
  keep_some(&answer.warnings);
  if (!answer.errors.empty()) return answer;
  std::set<std::string> used;
  for (const SourceFile& file : result.scene.files) used.insert(file.name);
  answer.bundle = question.files;
  answer.bundle.camera = result.scene.chosen_camera;
  answer.bundle.environment = result.scene.chosen_environment;
  std::erase_if(answer.bundle.entries, [&](const BundleEntry& e) { return !used.contains(e.name); });
  return answer;
}

}  // namespace lightmill
