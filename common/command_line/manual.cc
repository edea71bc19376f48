#include "common/command_line/manual.h"

#include <CLI/CLI.hpp>

#include "common/command_line/option_table.h"

namespace lightmill {
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

/// One line to a verb, or one for a program that has none.
std::string synopsis(const std::string& program, const std::vector<VerbRow>& verbs, bool runs_without_verb) {
  std::string lines;
  if (runs_without_verb) lines += "\\fB" + plain(program) + "\\fR [\\fIoptions\\fR]\n";
  for (const VerbRow& verb : verbs) {
    if (!lines.empty()) lines += ".br\n";
    lines += "\\fB" + plain(program + " " + verb.name) + "\\fR";
    for (const OptionRow& option : verb.options) {
      if (option.positional) lines += " \\fI" + option.names.front() + "\\fR";
    }
    lines += " [\\fIoptions\\fR]\n";
  }
  return lines;
}

std::string upper_case(std::string text) {
  for (char& c : text) {
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  }
  return text;
}

}  // namespace

std::string manual_page(const CLI::App& app, const ManualText& text) {
  const std::vector<VerbRow> verbs = verb_table(app);
  std::string s = ".TH " + plain(upper_case(text.name)) + " 1 \"\" \"" + plain(text.version) +
                  "\" \"User Commands\"\n.SH NAME\n" + plain(text.name) + " \\- " + plain(text.summary) +
                  "\n.SH SYNOPSIS\n" + synopsis(text.name, verbs, app.get_require_subcommand_min() == 0) +
                  ".SH DESCRIPTION\n" + text.description + ".SH OPTIONS\n";
  for (const OptionRow& option : option_table(app)) s += option_entry(option);
  if (!verbs.empty()) s += ".SH COMMANDS\n";
  for (const VerbRow& verb : verbs) {
    s += ".SS " + plain(verb.name) + "\n" + plain(verb.help) + ".\n";
    for (const OptionRow& option : verb.options) s += option_entry(option);
  }
  return s + text.closing;
}

void add_manual_flag(CLI::App& app, const ManualText& text) {
  const auto print = [&app, text] {
    std::string page = manual_page(app, text);
    page.pop_back();  // the end of its last line is printed with it
    throw CLI::CallForVersion(page, 0);
  };
  app.add_flag_callback("--man", print, "Print the manual page: " + text.name + " --man | man -l -")
      ->configurable(false);
}

}  // namespace lightmill
