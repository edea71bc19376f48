#pragma once
// The command line as data, read off the parser itself: what completions and manual pages are made of.
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace lightmill {

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

/// The options of `app` itself that its help names, without those of its verbs.
std::vector<OptionRow> option_table(const CLI::App& app);
/// All verbs of `app` that its help names, in the order they were added, with all their options.
std::vector<VerbRow> verb_table(const CLI::App& app);

}  // namespace lightmill
