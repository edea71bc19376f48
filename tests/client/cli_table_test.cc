// Completions and the manual page: they name everything that the parser knows, and a shell runs them.
#include <gmock/gmock.h>

#include <CLI/CLI.hpp>
#include <cstdlib>

#include "client/terminal/watch_screen.h"
#include "tests/client/cli_fixture.h"

namespace lightmill::client {
namespace {

using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;

class CliTable : public testing::CliTest {
 protected:
  /// stdout of a command in a shell; fails the test on another exit code than 0.
  std::string shell(const std::string& command) {
    const int code = std::system((command + " > shell.out 2> shell.err").c_str());
    std::ifstream in("shell.out"), err("shell.err");
    EXPECT_EQ(code, 0) << std::string(std::istreambuf_iterator<char>(err), {});
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static bool installed(const std::string& program) {
    return std::system(("command -v " + program + " > /dev/null 2>&1").c_str()) == 0;
  }
};

/// Names of options in the help of a verb: what stands before the first blank of its lines.
std::vector<std::string> options_in(const std::string& help) {
  std::vector<std::string> names;
  for (size_t at = help.find("  -"); at != std::string::npos; at = help.find("  -", at + 1)) {
    const size_t end = help.find_first_of(" \n", at + 2);
    std::string text = help.substr(at + 2, end - at - 2);
    for (size_t begin = 0; begin < text.size();) {
      const size_t comma = std::min(text.find(',', begin), text.size());
      names.push_back(text.substr(begin, comma - begin));
      begin = comma + 1;
    }
  }
  return names;
}

TEST_F(CliTable, ScriptsAndTheManualNameEveryOptionOfTheHelp) {
  const std::string page = run({"man"}).out;
  std::string manual;
  for (const char c : page) {
    if (c != '\\') manual += c;
  }
  const std::string bash = run({"completion", "bash"}).out, zsh = run({"completion", "zsh"}).out,
                    fish = run({"completion", "fish"}).out;
  size_t count = 0;
  for (const char* verb :
       {"render", "submit", "watch", "fetch", "extend", "check", "mix", "report", "completion", "man"}) {
    for (const std::string& script : {bash, zsh, fish, manual}) EXPECT_THAT(script, HasSubstr(verb));
    for (const std::string& name : options_in(run({verb, "--help"}).out)) {
      ++count;
      EXPECT_THAT(bash, HasSubstr(name)) << verb;
      EXPECT_THAT(zsh, HasSubstr(name)) << verb;
      EXPECT_THAT(manual, HasSubstr(name)) << verb;
      const bool is_long = name.starts_with("--");
      EXPECT_THAT(fish, HasSubstr(is_long ? " -l " + name.substr(2) : " -s " + name.substr(1))) << verb;
    }
  }
  EXPECT_GT(count, 80u);
}

TEST_F(CliTable, BashCompletesVerbsOptionsAndChoices) {
  write("completion.bash", run({"completion", "bash"}).out);
  const auto complete = [&](const std::string& words, int at) {
    return shell("bash -c '. ./completion.bash; COMP_WORDS=(" + words +
                 "); COMP_CWORD=" + std::to_string(at) + "; _lightmill; echo ${COMPREPLY[@]}'");
  };
  EXPECT_EQ(complete("lightmill re", 1), "render resume retry report\n");
  EXPECT_EQ(complete("lightmill render --aov", 2), "--aov\n");
  EXPECT_EQ(complete("lightmill render --integrator b", 3), "bdpt\n");
  EXPECT_EQ(complete("lightmill render --view \"\"", 3), "srgb filmic aces none\n");
  EXPECT_EQ(complete("lightmill denoise --colorspace \"\"", 3), "rec709 acescg aces2065-1 rec2020\n");
  EXPECT_EQ(complete("lightmill completion z", 2), "zsh\n");
  EXPECT_EQ(complete("lightmill render --spp \"\"", 3), "\n");  // left to the names of files
}

TEST_F(CliTable, OtherShellsAcceptTheirScripts) {
  write("completion.zsh", run({"completion", "zsh"}).out);
  write("completion.fish", run({"completion", "fish"}).out);
  bool any = false;
  if (installed("zsh")) any = true, shell("zsh -n completion.zsh");
  if (installed("fish")) any = true, shell("fish -n completion.fish");
  if (!any) GTEST_SKIP() << "neither zsh nor fish is installed";
}

TEST_F(CliTable, TheManualIsCleanRoff) {
  if (!installed("groff")) GTEST_SKIP() << "groff is not installed";
  write("lightmill.1", run({"man"}).out);
  EXPECT_EQ(shell("sh -c 'groff -man -Tascii -ww lightmill.1 2>&1 >/dev/null'"), "");
  const std::string text = shell("sh -c 'groff -man -Tascii -P-c -P-b -P-u lightmill.1'");
  EXPECT_THAT(text, HasSubstr("EXIT STATUS"));
}

TEST(WatchScreen, ShowsTheJobItsErrorAndItsWorkersWithinTheTerminal) {
  JobStatus s;
  s.id = JobId{"j7"};
  s.name = "cornell";
  s.state = JobState::kRunning;
  s.settings.spp = 64;
  s.settings.target_error = 0.01;
  s.spp = 32;
  s.packets_done = 1, s.packets_total = 4;
  s.relmse = 0.02, s.relmse_low = 0.015, s.relmse_high = 0.025;
  s.boxes[1].relmse = 0.03;
  s.eta_seconds = 75;
  s.workers = 2;
  std::vector<WorkerStatus> workers(30);
  for (size_t i = 0; i < workers.size(); ++i) {
    workers[i].id = WorkerId{"w" + std::to_string(i)};
    workers[i].state = "rendering";
    workers[i].samples_per_second = static_cast<double>(i);
  }
  const auto lines = watch_lines(s, workers, 60, 12, false);
  std::string all;
  for (const std::string& line : lines) {
    EXPECT_LE(line.size(), 60u);
    all += line + "\n";
  }
  EXPECT_LE(lines.size(), 12u);
  for (const char* text : {"j7", "cornell", "running", "32 of 64", "0.02", "0.015 to 0.025", "16 px 0.03",
                           "ETA 1 min 15 s", "w29"}) {
    EXPECT_THAT(all, HasSubstr(text));
  }
  EXPECT_THAT(all, Not(HasSubstr("\033"))) << "colours only where they are asked for";
  EXPECT_THAT(watch_lines(s, workers, 60, 12, true).front(), HasSubstr("\033["));
}

}  // namespace
}  // namespace lightmill::client
