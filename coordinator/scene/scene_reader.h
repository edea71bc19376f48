#pragma once
// What a scene that comes file by file, as from a browser, still lacks, and what job it would be.
//
// The caller sends the scene file alone first, learns which files it refers to, sends those, and asks again
// until nothing is missing. What is read is the format's text and meshes, by the reader that clients use.
#include <string>
#include <vector>

#include "common/farm/farm_types.h"
#include "common/scene/bundle.h"
#include "common/scene/resolve_settings.h"

namespace lightmill {

struct SceneQuestion {
  /// The files that are there; checked by bundle_from_json.
  Bundle files;
  /// Where each can be opened, in the order of `files.entries`.
  std::vector<std::string> paths;
  bool strict = false;  // unsupported features are errors
  RenderOptions options;
};

struct SceneAnswer {
  struct Missing {
    std::string reference;  // as the scene says it, relative to the scene file's folder
    std::string name;       // that the file must have in the bundle
  };
  std::vector<std::string> errors, warnings;  // one line each: "file:line:column: message"
  std::vector<Missing> missing;               // referred to and not there; each also makes an error
  // Only without errors:
  Bundle bundle;  // `files` without those that the scene does not use
  RenderSettings settings;
};

/// More problems and missing files are left out of an answer.
inline constexpr size_t kMostProblems = 200, kMostMissing = 20000;

/// Never throws for what is in the files; Error(kUsage) for options out of range.
SceneAnswer read_scene(const SceneQuestion& question);

// As JSON, for a reader in a process of its own (reader_process.h). Throw Error(kUsage) if it is malformed.
std::string question_to_json(const SceneQuestion& question);
SceneQuestion question_from_json(const std::string& text);
std::string answer_to_json(const SceneAnswer& answer);
/// `question` is what was asked: an answer that goes beyond it is malformed.
SceneAnswer answer_from_json(const std::string& text, const SceneQuestion& question);

}  // namespace lightmill
