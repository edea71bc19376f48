#include "client/cli.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "common/base/error.h"
#include "common/base/error_line.h"
#include "common/build_id/build_id.h"

namespace lightmill::client {
namespace {

/// CLI11's messages may span lines; the contract is one.
std::string one_line(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  for (char& c : text) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  return text;
}

int fail(const std::string& message, int code) {
  std::fprintf(stderr, "lightmill: %s\n", one_line(message).c_str());
  return code;
}

/// The verb that was being parsed, for "see lightmill VERB --help".
std::string chosen_verb(const CLI::App& app) {
  const auto chosen = app.get_subcommands();
  return chosen.empty() ? "" : chosen.front()->get_name() + " ";
}

}  // namespace

int run_cli(int argc, const char* const* argv) {
  CLI::App app{"Lightmill: a distributed render farm for physically based light transport", "lightmill"};
  app.set_version_flag("--version", build_id());
  app.require_subcommand(1);
  app.set_help_flag("--help,-h", "Print this help");
  Action action;
  for (const auto add :
       {add_render, add_submit, add_watch, add_listings, add_logs, add_control, add_fetch, add_explain,
        add_check, add_compare, add_denoise, add_mix, add_report, add_completion, add_manual}) {
    add(app, action);
  }
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; })) {
    const_cast<CLI::App*>(verb)->set_help_flag("--help,-h", "Print this help");
  }
  try {
    try {
      app.parse(argc, argv);
    } catch (const CLI::Success& success) {  // --help, --version
      return app.exit(success);
    } catch (const CLI::ParseError& error) {
      const std::string verb = chosen_verb(app);
      std::string message = error.what();
      if (verb.empty() && argc > 1 && argv[1][0] != '-')
        message = std::string("unknown command \"") + argv[1] + "\"";
      if (argc <= 1) message = "no command given";
      return fail(one_line(message) + "; see lightmill " + verb + "--help", 2);
    }
    return action();
  } catch (const Error& error) {
    return fail(error.what(), error.exit_code());
  } catch (const std::exception& error) {
    return fail(error_line(error), 1);
  }
}

}  // namespace lightmill::client
