// lightmill check: parse and validate only; every problem with file:line:column. What only shows in images
// and finished geometry is found by building the scene as for rendering.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <regex>

#include "client/cli.h"
#include "client/options.h"
#include "common/base/error.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill::client {
namespace {

struct CheckOptions {
  CommonOptions common;
  SceneOptions scene;
};

/// A builder's error, whose text begins with its place if it has one.
Problem problem_of(const Error& error, const std::string& scene_file) {
  Problem problem;
  static const std::regex place("^([^\n]*?):([0-9]{1,9}):([0-9]{1,9}): ");
  const std::string text = error.what();
  std::smatch found;
  if (std::regex_search(text, found, place)) {
    problem.where = {found[1].str(), std::stoi(found[2].str()), std::stoi(found[3].str())};
    problem.message = found.suffix();
  } else {
    problem.where = {scene_file, 1, 1};
    problem.message = text;
  }
  return problem;
}

/// What a renderer finds in the scene's images and geometry.
void add_render_problems(const SceneDescription& scene, const std::string& scene_file,
                         std::vector<Problem>* problems) {
  try {
    BuildOptions options;
    options.unused_textures = true;
    const std::vector<Problem> warnings = build_scene(scene, false, 0, options).warnings;
    problems->insert(problems->end(), warnings.begin(), warnings.end());
  } catch (const Error& error) {
    problems->push_back(problem_of(error, scene_file));
  }
}

std::vector<Problem> find_problems(const CheckOptions& options, std::string* format) {
  const std::filesystem::path path(options.scene.scene);
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  const LoadResult result =
      load_scene(path.filename().string(), DirectoryFiles(folder.string(), options.scene.map),
                 load_options(options.scene));
  *format = result.scene.format;
  std::vector<Problem> problems = result.problems;
  if (result.ok()) add_render_problems(result.scene, path.filename().string(), &problems);
  for (Problem& problem : problems) {  // the reader names files relative to the scene's folder
    const std::filesystem::path file(problem.where.file);
    if (path.has_parent_path() && file.is_relative()) problem.where.file = (folder / file).string();
  }
  if (result.ok()) {
    try {
      resolve_settings(result.scene, options.scene.render);
    } catch (const Error& error) {
      Problem problem;
      problem.where.file = options.scene.scene;
      problem.where.line = problem.where.column = 1;
      problem.message = error.what();
      problems.push_back(problem);
    }
  }
  return problems;
}

int check(const CheckOptions& options) {
  std::string format;
  const std::vector<Problem> problems = find_problems(options, &format);
  int errors = 0;
  nlohmann::json list = nlohmann::json::array();
  for (const Problem& problem : problems) {
    const bool is_error = problem.severity == Severity::kError;
    errors += is_error;
    if (options.common.json) {
      list.push_back({{"file", problem.where.file},
                      {"line", problem.where.line},
                      {"column", problem.where.column},
                      {"severity", is_error ? "error" : "warning"},
                      {"message", problem.message}});
    } else {
      std::printf("%s\n", format_problem(problem).c_str());
    }
  }
  if (options.common.json) {
    const nlohmann::json document = {{"format", format}, {"problems", list}};
    std::printf("%s\n", document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace).c_str());
  }
  const auto warnings = static_cast<int>(problems.size()) - errors;
  if (errors > 0) {
    throw Error(ErrorKind::kBadScene, options.scene.scene + ": " + std::to_string(errors) + " error(s), " +
                                          std::to_string(warnings) + " warning(s)");
  }
  if (!options.common.quiet && !options.common.json) {
    std::printf("%s: %s, no errors, %d warning(s)\n", options.scene.scene.c_str(), format.c_str(), warnings);
  }
  return 0;
}

}  // namespace

void add_check(CLI::App& app, Action& action) {
  auto options = std::make_shared<CheckOptions>();
  CLI::App* verb =
      add_verb(app, "check", "List every problem of a scene, without rendering it", &options->common);
  add_json(verb, &options->common);
  add_scene(verb, &options->scene);
  verb->callback([&action, options] { action = [options] { return check(*options); }; });
}

}  // namespace lightmill::client
