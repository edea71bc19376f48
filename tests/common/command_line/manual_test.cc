// What a manual page is made of: everything that the help names, and nothing that it leaves out.
#include "common/command_line/manual.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <sstream>

#include "common/command_line/option_table.h"

namespace lightmill {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class Manual : public ::testing::Test {
 protected:
  Manual() {
    app_.add_option("--threads,-t", threads_, "Render threads")
        ->envname("MILL_THREADS")
        ->capture_default_str();
    app_.add_option("--old-name", threads_)->group("");
    app_.add_option("--format", format_, ".dots and 'quotes'")->check(CLI::IsMember({"text", "json"}));
    app_.add_subcommand("grind", "Grind something")->add_option("SACK", format_, "Of what")->required();
    app_.add_subcommand("own-use")->group("");
  }
  std::string page() const {
    return manual_page(app_, {"mill", "grinds", "mill 1.0", "It grinds.\n", ".SH SEE ALSO\nbread\n"});
  }

  CLI::App app_{"A mill", "mill"};
  int threads_ = 7;
  std::string format_;
};

TEST_F(Manual, HasTheOptionsAndTheVerbsOfTheHelp) {
  EXPECT_THAT(page(), HasSubstr(".TP\n\\fB\\-\\-threads\\fR, \\fB\\-t\\fR \\fIvalue\\fR\n"
                                "Render threads. Default: 7. Environment: MILL_THREADS.\n"));
  EXPECT_THAT(page(), HasSubstr("One of: text json."));
  EXPECT_THAT(page(), HasSubstr("\\fBmill grind\\fR \\fISACK\\fR [\\fIoptions\\fR]\n"));
  EXPECT_THAT(page(), HasSubstr(".SS grind\nGrind something.\n"));
  EXPECT_THAT(page(), Not(HasSubstr("old")));
  EXPECT_THAT(page(), Not(HasSubstr("own")));
}

TEST_F(Manual, NoTextIsTakenForACommandOfRoff) {
  EXPECT_THAT(page(), HasSubstr("\n\\&.dots and 'quotes'. One of"));
}

TEST_F(Manual, ProgramsWithoutVerbsRunByThemselves) {
  EXPECT_THAT(page(), HasSubstr(".SH SYNOPSIS\n\\fBmill\\fR [\\fIoptions\\fR]\n.br\n"));
  app_.require_subcommand(1);
  EXPECT_THAT(page(), HasSubstr(".SH SYNOPSIS\n\\fBmill grind\\fR"));
}

TEST_F(Manual, TheFlagPrintsThePageAndIsInIt) {
  add_manual_flag(app_, {"mill", "grinds", "mill 1.0", "It grinds.\n", ""});
  std::ostringstream out, err;
  try {
    app_.parse("--man");
    FAIL() << "nothing was printed";
  } catch (const CLI::Success& success) {
    EXPECT_EQ(app_.exit(success, out, err), 0);
  }
  EXPECT_EQ(out.str(), manual_page(app_, {"mill", "grinds", "mill 1.0", "It grinds.\n", ""}));
  EXPECT_THAT(out.str(), HasSubstr("\\fB\\-\\-man\\fR\n"));
}

TEST_F(Manual, TheTableKnowsNamesAndChoices) {
  const std::vector<OptionRow> rows = option_table(app_);
  ASSERT_EQ(rows.size(), 3u);  // --help, too
  EXPECT_THAT(rows[1].names, ElementsAre("--threads", "-t"));
  EXPECT_THAT(rows[2].choices, ElementsAre("text", "json"));
  ASSERT_EQ(verb_table(app_).size(), 1u);
  EXPECT_TRUE(verb_table(app_)[0].options[1].positional);
}

}  // namespace
}  // namespace lightmill
