#include "common/command_line/option_table.h"

#include <CLI/CLI.hpp>
#include <algorithm>

namespace lightmill {
namespace {

/// The choices in CLI11's name of a type, such as "TEXT:{pt,bdpt}".
std::vector<std::string> choices_in(const std::string& type) {
  std::vector<std::string> choices;
  const size_t open = type.find('{'), close = type.find('}');
  if (open == std::string::npos || close == std::string::npos) return choices;
  for (size_t begin = open + 1; begin < close;) {
    const size_t end = std::min(type.find(',', begin), close);
    choices.push_back(type.substr(begin, end - begin));
    begin = end + 1;
  }
  return choices;
}

OptionRow row_of(const CLI::Option& option) {
  OptionRow row;
  row.positional = option.get_positional();
  if (row.positional) row.names.push_back(option.get_name(true));
  for (const std::string& name : option.get_lnames()) row.names.push_back("--" + name);
  for (const std::string& name : option.get_snames()) row.names.push_back("-" + name);
  row.takes_value = option.get_expected_max() > 0;
  row.required = option.get_required();
  if (row.takes_value) row.choices = choices_in(option.get_type_name());
  row.help = option.get_description();
  row.default_value = option.get_default_str();
  row.environment = option.get_envname();
  return row;
}

/// Of an option or a verb. What the help leaves out, for it has no group, is left out here.
template <class Part>
bool is_named(const Part* part) {
  return !part->get_group().empty();
}

}  // namespace

std::vector<OptionRow> option_table(const CLI::App& app) {
  std::vector<OptionRow> rows;
  for (const CLI::Option* option : app.get_options(is_named<CLI::Option>)) rows.push_back(row_of(*option));
  return rows;
}

std::vector<VerbRow> verb_table(const CLI::App& app) {
  std::vector<VerbRow> verbs;
  for (const CLI::App* verb : app.get_subcommands(is_named<CLI::App>))
    verbs.push_back({verb->get_name(), verb->get_description(), option_table(*verb)});
  return verbs;
}

}  // namespace lightmill
