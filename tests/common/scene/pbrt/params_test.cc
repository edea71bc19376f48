#include "common/scene/pbrt/params.h"

#include <gtest/gtest.h>

#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

/// The parameter list of `text`, with the problems it caused.
struct Parsed {
  explicit Parsed(const std::string& text)
      : tokenizer(text, &file, &problems),
        list("shape \"test\"", {"a.pbrt", 1, 1}, parse_parameters(tokenizer, ColorSpace::kSrgb, &problems),
             &problems) {}
  std::string messages() {
    std::string all;
    for (const Problem& p : problems.take()) all += format_problem(p) + "\n";
    return all;
  }
  std::string file = "a.pbrt";
  ProblemList problems{false};
  PbrtTokenizer tokenizer;
  ParameterList list;
};

TEST(Params, EveryType) {
  Parsed p(R"("integer i" 3 "float f" [1.5] "bool b" true "string s" "text" "texture t" ["tex"]
              "point2 p2" [1 2] "point3 P" [1 2 3 4 5 6] "vector3 v" [0 0 1] "normal N" [0 1 0] "rgb c" [1 0.5 0]
              "spectrum n" "metal-Cu-eta" "spectrum w" [400 1 700 2] "blackbody k" 5000 "point old" [1 2 3])");
  EXPECT_EQ(p.list.integer("i", 0, 0, 10), 3);
  EXPECT_EQ(p.list.number("f", 0, 0, 10), 1.5);
  EXPECT_TRUE(p.list.boolean("b", false));
  EXPECT_EQ(p.list.text("s", ""), "text");
  EXPECT_EQ(p.list.find("t", {ParamType::kTexture})->strings.at(0), "tex");
  EXPECT_EQ(p.list.numbers("p2", ParamType::kPoint2)->size(), 2u);
  EXPECT_EQ(p.list.numbers("P", ParamType::kPoint3)->size(), 6u);
  EXPECT_NE(p.list.numbers("v", ParamType::kVector3), nullptr);
  EXPECT_NE(p.list.numbers("N", ParamType::kNormal), nullptr);
  EXPECT_NE(p.list.numbers("c", ParamType::kRgb), nullptr);
  EXPECT_EQ(p.list.find("n", {ParamType::kSpectrum})->strings.at(0), "metal-Cu-eta");
  EXPECT_EQ(p.list.find("w", {ParamType::kSpectrum})->numbers.size(), 4u);
  EXPECT_NE(p.list.numbers("k", ParamType::kBlackbody, 1), nullptr);
  EXPECT_NE(p.list.numbers("old", ParamType::kPoint3, 3), nullptr);
  p.list.finish();
  EXPECT_EQ(p.messages(), "");
}

TEST(Params, AbsentGivesTheFallback) {
  Parsed p("");
  EXPECT_EQ(p.list.number("f", 2.5, 0, 10), 2.5);
  EXPECT_EQ(p.list.text("s", "x"), "x");
  EXPECT_FALSE(p.list.has("f"));
}

TEST(Params, UnknownIsReportedAtItsDeclarationWithAHint) {
  Parsed p("\n   \"float radiuss\" 2");
  p.list.number("radius", 1, 0, 10);
  p.list.finish();
  EXPECT_EQ(p.messages(),
            "a.pbrt:2:4: unknown parameter \"radiuss\" of shape \"test\"; did you mean \"radius\"?\n");
}

TEST(Params, WrongTypeCountAndRange) {
  const std::pair<const char*, const char*> cases[] = {
      {"\"integer f\" 2", "has type \"integer\"; it must be \"float\""},
      {"\"float f\" [1 2]", "has 2 numbers; it needs 1"},
      {"\"float f\" -1", "must be at least 0, not -1"},
      {"\"float f\" 11", "must be at most 10, not 11"},
      {"\"float f\" \"two\"", "needs finite numbers, not the string \"two\""},
      {"\"float f\" nan", "needs finite numbers"},
      {"\"float f\" [1e300]", "needs numbers in float's range"},
      {"\"float f\"", "has no value"},
      {"\"float f\" []", "has no value"},
      {"\"float f\" Shape", "has no value"},
      {"\"float f\" [1", "never closed"},
      {"\"float f\" 7 \"integer f\" 2", "is given twice, by values of two types"},
      {"\"f\" 1", "declared as \"type name\""},
      {"\"flaot f\" 1", "unknown parameter type \"flaot\"; did you mean \"float\"?"},
      {"\"color f\" [1 1 1]", "did you mean \"rgb\"?"},
  };
  for (const auto& [text, message] : cases) {
    Parsed p(text);
    EXPECT_EQ(p.list.number("f", 7, 0, 10), 7) << text;
    EXPECT_NE(p.messages().find(message), std::string::npos) << text;
  }
}

TEST(Params, OfOneGivenTwiceTheLastIsTaken) {
  Parsed p("\"float f\" 1 \"float f\" 2");
  EXPECT_EQ(p.list.number("f", 7, 0, 10), 2);
  EXPECT_EQ(p.problems.errors(), 0);
  EXPECT_NE(p.messages().find("a.pbrt:1:13: warning: parameter \"f\" is given twice"), std::string::npos)
      << p.messages();
}

TEST(Params, IntegersAreWholeAndFit) {
  for (const char* text : {"\"integer i\" 1.5", "\"integer i\" 3000000000", "\"integer i\" x1"}) {
    Parsed p(text);
    EXPECT_EQ(p.list.integer("i", 7, 0, 10), 7);
    EXPECT_EQ(p.problems.errors(), 1) << text;
  }
}

TEST(Params, PointsNeedThreeNumbersEach) {
  Parsed p("\"point3 P\" [1 2 3 4]");
  EXPECT_EQ(p.list.numbers("P", ParamType::kPoint3), nullptr);
  EXPECT_NE(p.messages().find("multiple of 3"), std::string::npos);
}

TEST(Params, BadDeclarationDoesNotSwallowTheRest) {
  Parsed p("\"nonsense\" [1 2 3] \"float f\" 4");
  EXPECT_EQ(p.list.number("f", 0, 0, 10), 4);
  EXPECT_EQ(p.problems.errors(), 1);
}

}  // namespace
}  // namespace lightmill
