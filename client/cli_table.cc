#include "client/cli_table.h"

#include <CLI/CLI.hpp>

namespace lightmill::client {
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

}  // namespace

std::vector<VerbRow> verb_table(const CLI::App& app) {
  std::vector<VerbRow> verbs;
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; })) {
    VerbRow row{verb->get_name(), verb->get_description(), {}};
    for (const CLI::Option* option : verb->get_options()) row.options.push_back(row_of(*option));
    verbs.push_back(std::move(row));
  }
  return verbs;
}

}  // namespace lightmill::client
