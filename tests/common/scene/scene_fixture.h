#pragma once
// Scenes written to a temporary folder and loaded from there.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "common/scene/load.h"

namespace lightmill {

/// A folder of its own, removed at the end.
class TempFolder {
 public:
  TempFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "lightmill-scene-XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~TempFolder() { std::filesystem::remove_all(path_); }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;

  const std::string& path() const { return path_; }
  std::string write(const std::string& name, const std::string& contents) const {
    const std::filesystem::path file = std::filesystem::path(path_) / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << contents;
    return file.string();
  }

 private:
  std::string path_;
};

class SceneTest : public testing::Test {
 protected:
  /// Loads `text` as scene.pbrt.
  LoadResult load(const std::string& text, const LoadOptions& options = {}) {
    folder_.write("scene.pbrt", text);
    return load_scene("scene.pbrt", DirectoryFiles(folder_.path()), options);
  }
  /// The same with warnings as errors.
  LoadResult strictly(const std::string& text) { return load(text, strict()); }
  LoadResult strictly_world(const std::string& body) { return load_world(body, strict()); }
  static LoadOptions strict() {
    LoadOptions options;
    options.strict = true;
    return options;
  }
  /// Loads a world that has a light (so that it is complete) on line 1, and `body` from line 2.
  LoadResult load_world(const std::string& body, const LoadOptions& options = {}) {
    return load("WorldBegin LightSource \"point\"\n" + body, options);
  }
  /// As load_world, with an expectation that nothing was reported.
  SceneDescription clean_world(const std::string& body) { return clean(load_world(body)); }
  SceneDescription clean(LoadResult result) {
    for (const Problem& p : result.problems) ADD_FAILURE() << format_problem(p);
    return std::move(result.scene);
  }

  TempFolder folder_;
};

/// All problems, one a line, as programs print them.
inline std::string listed(const LoadResult& result) {
  std::string all;
  for (const Problem& p : result.problems) all += format_problem(p) + "\n";
  return all;
}

inline bool mentions(const LoadResult& result, const std::string& text) {
  return listed(result).find(text) != std::string::npos;
}

/// There is an error, `text` is listed, and so is a place on line 2 of scene.pbrt.
inline testing::AssertionResult refused_on_line_2(const LoadResult& result, const std::string& text) {
  if (result.ok()) return testing::AssertionFailure() << "no error; " << listed(result);
  if (!mentions(result, text) || !mentions(result, "scene.pbrt:2:"))
    return testing::AssertionFailure() << "wanted \"" << text << "\" on line 2 in\n" << listed(result);
  return testing::AssertionSuccess();
}

/// An error that holds `text` is listed, and every message is one line.
inline testing::AssertionResult has_error(const LoadResult& result, const std::string& text) {
  if (result.ok()) return testing::AssertionFailure() << "no error; " << listed(result);
  for (const Problem& p : result.problems) {
    if (p.message.find('\n') != std::string::npos)
      return testing::AssertionFailure() << "not one line: " << p.message;
  }
  if (!mentions(result, text))
    return testing::AssertionFailure() << "wanted \"" << text << "\" in\n" << listed(result);
  return testing::AssertionSuccess();
}

}  // namespace lightmill
