#pragma once
// The command line as data, read off the parser itself: what completions and manual pages are made of.
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace lightmill::client {

struct OptionRow {
  std::vector<std::string> names;  // "--output", "-o"; of a positional its name: "SCENE"
  bool positional = false, takes_value = false, required = false;
  std::vector<std::string> choices;  // of its value; empty if it is free
  std::string help, default_value, environment;
};

struct VerbRow {
  std::string name, help;
  std::vector<OptionRow> options;
};

/// All verbs of `app`, in the order they were added, with all their options.
std::vector<VerbRow> verb_table(const CLI::App& app);

/// A completion script for "bash", "zsh" or "fish"; throws Error(kUsage) for another shell.
std::string completion_script(const std::vector<VerbRow>& verbs, const std::string& shell);
/// The manual page lightmill(1), in the man macros of roff; `version` stands at its foot.
std::string manual_page(const std::vector<VerbRow>& verbs, const std::string& version);

}  // namespace lightmill::client
