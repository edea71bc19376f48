// lightmill completion SHELL: scripts that complete verbs, options and the values that options choose from.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "client/cli.h"
#include "client/options.h"
#include "common/base/error.h"
#include "common/command_line/option_table.h"

namespace lightmill::client {
namespace {

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) {
    if (!text.empty()) text += ' ';
    text += word;
  }
  return text;
}

std::string flags_of(const VerbRow& verb) {
  std::vector<std::string> names;
  for (const OptionRow& option : verb.options) {
    if (!option.positional) names.insert(names.end(), option.names.begin(), option.names.end());
  }
  return joined(names);
}

std::string names_of(const std::vector<VerbRow>& verbs) {
  std::vector<std::string> names;
  names.reserve(verbs.size());
  for (const VerbRow& verb : verbs) names.push_back(verb.name);
  return joined(names);
}

/// Within single quotes, with a backslash before each of `special`.
std::string quoted(const std::string& text, const std::string& special = "") {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'') {
      out += "'\\''";
      continue;
    }
    if (special.find(c) != std::string::npos) out += '\\';
    out += c;
  }
  return out += '\'';
}

/// What is not chosen from a list is completed as the name of a file.
std::string bash(const std::vector<VerbRow>& verbs) {
  std::string s = R"(# Completion of lightmill for bash: . <(lightmill completion bash)
_lightmill() {
  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]} verb=${COMP_WORDS[1]}
  COMPREPLY=()
  if ((COMP_CWORD == 1)); then
    COMPREPLY=($(compgen -W ')";
  s += names_of(verbs) + " --help --version' -- \"$cur\"))\n    return\n  fi\n  case \"$verb $prev\" in\n";
  for (const VerbRow& verb : verbs) {
    for (const OptionRow& option : verb.options) {
      if (option.positional || !option.takes_value) continue;
      std::string patterns;
      for (const std::string& name : option.names) {
        if (!patterns.empty()) patterns += '|';
        patterns.append("'").append(verb.name).append(" ").append(name).append("'");
      }
      s += "    " + patterns + ") ";
      if (!option.choices.empty()) {
        s += "COMPREPLY=($(compgen -W '" + joined(option.choices) + "' -- \"$cur\")); ";
      }
      s += "return ;;\n";
    }
  }
  s += "  esac\n  case \"$verb\" in\n";
  for (const VerbRow& verb : verbs) {
    std::string words = "[[ $cur == -* ]] && COMPREPLY=($(compgen -W '" + flags_of(verb) + "' -- \"$cur\"))";
    for (const OptionRow& option : verb.options) {
      if (!option.positional || option.choices.empty()) continue;
      words += "; [[ $cur != -* ]] && COMPREPLY=($(compgen -W '" + joined(option.choices) + "' -- \"$cur\"))";
    }
    s += "    " + verb.name + ") " + words + " ;;\n";
  }
  return s + "  esac\n}\ncomplete -o default -F _lightmill lightmill\n";
}

std::string zsh(const std::vector<VerbRow>& verbs) {
  std::string s = "#compdef lightmill\n# Completion of lightmill for zsh: . <(lightmill completion zsh)\n";
  s += "_lightmill() {\n  local -a verbs\n  verbs=(\n";
  for (const VerbRow& verb : verbs) s += "    " + quoted(verb.name + ":" + verb.help) + "\n";
  s += "  )\n  if (( CURRENT == 2 )); then\n    _describe command verbs\n    return\n  fi\n";
  s += "  local verb=$words[2]\n  shift words\n  (( CURRENT-- ))\n  case $verb in\n";
  for (const VerbRow& verb : verbs) {
    s += "    " + verb.name + ")\n      _arguments";
    for (const OptionRow& option : verb.options) {
      const std::string values = option.choices.empty() ? "_files" : "(" + joined(option.choices) + ")";
      if (option.positional) {
        s += " \\\n        " + quoted(":" + option.names.front() + ":" + values);
        continue;
      }
      for (const std::string& name : option.names) {
        const std::string value = option.takes_value ? ":value:" + values : "";
        s += " \\\n        '" + name + "['" + quoted(option.help, "[]:\\") + "']" + value + "'";
      }
    }
    s += " ;;\n";
  }
  // As a file on fpath it is the body of the function that it defines, and its first call must complete, too.
  return s +
         "  esac\n}\nif [[ $funcstack[1] == _lightmill ]]; then\n  _lightmill \"$@\"\nelse\n"
         "  compdef _lightmill lightmill\nfi\n";
}

std::string fish(const std::vector<VerbRow>& verbs) {
  std::string s = "# Completion of lightmill for fish: lightmill completion fish | source\n";
  for (const VerbRow& verb : verbs) {
    s += "complete -c lightmill -n __fish_use_subcommand -f -a " + verb.name + " -d " +
         quoted(verb.help, "\\") + "\n";
  }
  for (const VerbRow& verb : verbs) {
    for (const OptionRow& option : verb.options) {
      std::string line = "complete -c lightmill -n '__fish_seen_subcommand_from " + verb.name + "'";
      for (const std::string& name : option.names) {
        if (option.positional) continue;
        line += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      }
      if (option.positional && option.choices.empty()) continue;  // files, as by default
      if (option.takes_value && !option.positional) line += option.choices.empty() ? " -r" : " -x";
      if (!option.choices.empty()) line += " -a " + quoted(joined(option.choices));
      s += line + " -d " + quoted(option.help, "\\") + "\n";
    }
  }
  return s;
}

std::string completion_script(const std::vector<VerbRow>& verbs, const std::string& shell) {
  if (shell == "bash") return bash(verbs);
  if (shell == "zsh") return zsh(verbs);
  if (shell == "fish") return fish(verbs);
  throw Error(ErrorKind::kUsage, "no completion for \"" + shell + "\"; there is bash, zsh and fish");
}

}  // namespace

void add_completion(CLI::App& app, Action& action) {
  struct Options {
    CommonOptions common;
    std::string shell;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* verb = add_verb(app, "completion", "Print a completion script for a shell", &options->common);
  verb->add_option("SHELL", options->shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  verb->callback([&app, &action, options] {
    action = [&app, options] {
      std::fputs(completion_script(verb_table(app), options->shell).c_str(), stdout);
      return 0;
    };
  });
}

}  // namespace lightmill::client
