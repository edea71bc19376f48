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

/// What problems of one kind have in common.
std::string without_numbers(const std::string& text) {
  std::string out;
  for (size_t i = 0; i < text.size(); ++i) {
    const bool digit = text[i] >= '0' && text[i] <= '9';
    if (!digit && text[i] != '-' && text[i] != '+') {
      out += text[i];
      continue;
    }
    out += digit ? "#" : "";
    while (digit && i + 1 < text.size() &&
           std::string_view("0123456789.e+-").find(text[i + 1]) != std::string_view::npos)
      ++i;
  }
  return out;
}
}  // namespace

void GltfScene::error(const GltfProblem& problem) {
  if (quiet_ > 0) return;
  problems->error(place_of_problem(problem.pointer), at_pointer(problem.pointer, problem.message));
}

void GltfScene::warning(const std::string& pointer, const std::string& message) {
  note(Gravity::kWarning, pointer, message);
}

void GltfScene::mended(const std::string& pointer, const std::string& message) {
  note(Gravity::kWarning, pointer, message);
}

void GltfScene::unsupported(const std::string& pointer, const std::string& what) {
  note(Gravity::kUnsupported, pointer, what);
}

void GltfScene::note(Gravity gravity, const std::string& pointer, const std::string& message) {
  if (quiet_ > 0) return;
  constexpr size_t kMaxKinds = ProblemList::kMaxWarnings;
  const auto [entry, is_new] =
      kind_of_.try_emplace(without_numbers(pointer) + '\n' + without_numbers(message), kinds_.size());
  if (is_new && kinds_.size() < kMaxKinds) kinds_.push_back({gravity, pointer, message, 0});
  if (entry->second < kinds_.size()) ++kinds_[entry->second].count;
  if (is_new && kinds_.size() == kMaxKinds) kind_of_.erase(entry);
}

void GltfScene::say_kinds() {
  for (const Kind& kind : kinds_) {
    const SourceLocation place =
        kind.pointer.empty() ? SourceLocation{name, 1, 1} : place_of_problem(kind.pointer);
    std::string text = at_pointer(kind.pointer, kind.message);
    if (kind.count > 1) text += ", and " + std::to_string(kind.count - 1) + " more like it";
    if (kind.gravity == Gravity::kUnsupported) {
      problems->unsupported(place, text);
    } else {
      problems->warning(place, text);
    }
  }
  kinds_.clear();
  kind_of_.clear();
}

std::string GltfScene::open_reference(const std::string& reference, const std::string& pointer) {
  std::string how;
  std::string path = files.resolve(reference, &how);
  if (path.empty()) {
    throw GltfProblem{pointer, "there is no file " + in_quotes(reference) +
                                   "; names are relative to the scene file" + files.hint(reference)};
  }
  if (!how.empty()) mended(pointer, "there is no file " + in_quotes(reference) + "; " + how);
  if (const std::string why = why_unreadable(path); !why.empty())
    throw GltfProblem{pointer, "can't read the file " + in_quotes(reference) + ": " + why};
  const std::string known_as = bundle_name(reference);
  if (listed_files_.insert(known_as).second) scene.files.push_back({known_as, path});
  return path;
}

}  // namespace lightmill
