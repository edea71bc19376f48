// lightmill man: the manual page.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "client/cli.h"
#include "client/cli_table.h"
#include "client/options.h"
#include "common/build_id/build_id.h"

namespace lightmill::client {
namespace {

/// Plain text for roff: no character of it is taken for a command.
std::string plain(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else {
      if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n')) out += "\\&";
      out += c;
    }
  }
  return out;
}

std::string option_entry(const OptionRow& option) {
  std::string names;
  for (const std::string& name : option.names) {
    if (!names.empty()) names += ", ";
    names += option.positional ? "\\fI" + plain(name) + "\\fR" : "\\fB" + plain(name) + "\\fR";
  }
  if (option.takes_value && !option.positional) names += " \\fIvalue\\fR";
  std::string help = option.help;
  if (!option.choices.empty()) {
    help += ". One of:";
    for (const std::string& choice : option.choices) help += " " + choice;
  }
  if (!option.default_value.empty()) help += ". Default: " + option.default_value;
  if (!option.environment.empty()) help += ". Environment: " + option.environment;
  return ".TP\n" + names + "\n" + plain(help) + ".\n";
}

std::string synopsis(const VerbRow& verb) {
  std::string line = ".br\n\\fBlightmill " + plain(verb.name) + "\\fR";
  for (const OptionRow& option : verb.options) {
    if (option.positional) line += " \\fI" + option.names.front() + "\\fR";
  }
  return line + " [\\fIoptions\\fR]\n";
}

}  // namespace

std::string manual_page(const std::vector<VerbRow>& verbs, const std::string& version) {
  std::string s = ".TH LIGHTMILL 1 \"\" " + ("\"" + plain(version)) + "\" \"User Commands\"\n";
  s += ".SH NAME\nlightmill \\- a distributed render farm for physically based light transport\n.SH "
       "SYNOPSIS\n";
  for (const VerbRow& verb : verbs) s += synopsis(verb);
  s += R"(.SH DESCRIPTION
Renders pbrt\-v4 and glTF 2.0 scenes, on this machine
.RB ( render )
or on a farm
.RB ( submit ", " watch ", " fetch ).
The image is the same, bit for bit, whoever rendered which part of it.
.SH COMMANDS
)";
  for (const VerbRow& verb : verbs) {
    s += ".SS " + plain(verb.name) + "\n" + plain(verb.help) + ".\n";
    for (const OptionRow& option : verb.options) s += option_entry(option);
  }
  s += R"(.SH EXIT STATUS
0: done. 1: it failed. 2: wrong usage or a bad scene. 3: the coordinator can't be reached, or refuses.
.SH ENVIRONMENT
.TP
.B LIGHTMILL_COORDINATOR
The coordinator's HOST:PORT; with standbys all of them, with commas between.
.TP
.B NO_COLOR
If set and not empty, nothing is coloured.
)";
  return s;
}

void add_manual(CLI::App& app, Action& action) {
  const auto common = std::make_shared<CommonOptions>();
  CLI::App* verb = add_verb(app, "man", "Print the manual page: lightmill man | man -l -", common.get());
  verb->callback([&app, &action, common] {
    action = [&app] {
      std::fputs(manual_page(verb_table(app), build_id().substr(0, build_id().find(" ("))).c_str(), stdout);
      return 0;
    };
  });
}

}  // namespace lightmill::client
