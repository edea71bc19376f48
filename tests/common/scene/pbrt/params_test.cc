#include "common/scene/pbrt/syntax/params.h"

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
  EXPECT_EQ(
      p.messages(),
      "a.pbrt:2:4: warning: unknown parameter \"radiuss\" of shape \"test\"; did you mean \"radius\"? It is "
      "left out\n");
}

TEST(Params, WhatCanStandForANumberIsTakenAndSaid) {
  struct Case {
    const char* text;
    double value;
    const char* message;
  };
  const Case cases[] = {
      {"\"integer f\" 2", 2, "has type \"integer\"; it must be \"float\", as which it is taken"},
      {"\"rgb f\" [1 2 3]", 2, "has type \"rgb\"; it must be \"float\", as which it is taken"},
      {"\"color f\" [1 1 1]", 1, "has type \"rgb\"; it must be \"float\""},
      {"\"spectrum f\" [400 2 700 4]", 3, "has type \"spectrum\""},
      {"\"string f\" \"2\"", 2, "has type \"string\""},
      {"\"string f\" \"two\"", 7, "it must be \"float\"; it is left out"},
      {"\"blackbody f\" 5000", 7, "it is left out"},
      {"\"float f\" [1 2]", 1, "has 2 numbers; it needs 1; the first are taken"},
      {"\"float f\" -1", 0, "must be at least 0, not -1; that is taken"},
      {"\"float f\" 11", 10, "must be at most 10, not 11; that is taken"},
      {"\"float f\" nan", 0, "has the value \"nan\", which is taken as 0"},
      {"\"float f\" -1.#IND", 0, "which is taken as 0"},
      {"\"float f\" [1e300]", 10, "has the value \"1e300\""},
      {"\"float f\" [1e400]", 10, "has the value \"1e400\""},
      {"\"float f\" 7 \"integer f\" 2", 2, "is given twice"},
      {"\"float f\" []", 7, "has no value; it is left out"},
      {"\"f\" 1", 7, "declared as \"type name\""},
      {"\"flaot f\" 1", 7, "unknown parameter type \"flaot\"; did you mean \"float\"?"},
  };
  for (const Case& c : cases) {
    Parsed p(c.text);
    EXPECT_EQ(p.list.number("f", 7, 0, 10), c.value) << c.text;
    EXPECT_EQ(p.problems.errors(), 0) << c.text;
    const std::string messages = p.messages();
    EXPECT_NE(messages.find(c.message), std::string::npos) << c.text << "\n" << messages;
  }
}

TEST(Params, WhatIsNoValueIsAnError) {
  const std::pair<const char*, const char*> cases[] = {
      {"\"float f\" \"two\"", "needs finite numbers, not the string \"two\""},
      {"\"float f\" [two2]", "needs finite numbers"},
      {"\"float f\"", "has no value"},
      {"\"float f\" Shape", "has no value"},
      {"\"float f\" [1", "never closed"},
  };
  for (const auto& [text, message] : cases) {
    Parsed p(text);
    EXPECT_EQ(p.list.number("f", 7, 0, 10), 7) << text;
    EXPECT_EQ(p.problems.errors(), 1) << text;
    const std::string messages = p.messages();
    EXPECT_NE(messages.find(message), std::string::npos) << text << "\n" << messages;
  }
}

TEST(Params, OtherTypesThatStandForTheRightOne) {
  Parsed p(R"("string b" "true" "integer c" 0 "float i" 2.6 "float tint" 0.5 "float uv" [1 2 3 4]
              "vector3 at" [1 2 3] "string map" "wood")");
  EXPECT_TRUE(p.list.boolean("b", false));
  EXPECT_FALSE(p.list.boolean("c", true));
  EXPECT_EQ(p.list.integer("i", 0, 0, 10), 3);
  EXPECT_EQ(p.list.find("tint", {ParamType::kRgb, ParamType::kTexture})->numbers,
            (std::vector<double>(3, 0.5)));
  EXPECT_EQ(p.list.numbers("uv", ParamType::kPoint2)->size(), 4u);
  EXPECT_EQ(p.list.numbers("at", ParamType::kPoint3, 3)->back(), 3);
  EXPECT_EQ(p.list.find("map", {ParamType::kTexture})->strings.at(0), "wood");
  EXPECT_EQ(p.problems.errors(), 0);
}

TEST(Params, AKindOfWarningIsSaidOnceAndCounted) {
  ProblemList problems(false);
  for (int i = 0; i < 3; ++i) {
    problems.warning({"a.pbrt", i + 1, 1}, "the mesh \"m" + std::to_string(i) + ".ply\" has " +
                                               std::to_string(i + 7) + " triangles without area");
  }
  problems.warning({"a.pbrt", 9, 1}, "parameter \"a\" of shape \"sphere\" is odd");
  problems.warning({"a.pbrt", 9, 1}, "parameter \"b\" of shape \"sphere\" is odd");
  const std::vector<Problem> all = problems.take();
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].message, "the mesh \"m0.ply\" has 7 triangles without area, and 2 more like it");
  EXPECT_EQ(all[0].where.line, 1);
  EXPECT_EQ(all[2].message, "parameter \"b\" of shape \"sphere\" is odd");
}

TEST(Params, OfOneGivenTwiceTheLastIsTaken) {
  Parsed p("\"float f\" 1 \"float f\" 2");
  EXPECT_EQ(p.list.number("f", 7, 0, 10), 2);
  EXPECT_EQ(p.problems.errors(), 0);
  EXPECT_NE(p.messages().find("a.pbrt:1:13: warning: parameter \"f\" is given twice"), std::string::npos)
      << p.messages();
}

TEST(Params, IntegersAreWholeAndFit) {
  const std::pair<const char*, int64_t> cases[] = {{"\"integer i\" 1.5", 2},
                                                   {"\"integer i\" 3000000000", 10}};
  for (const auto& [text, value] : cases) {
    Parsed p(text);
    EXPECT_EQ(p.list.integer("i", 7, 0, 10), value);
    EXPECT_EQ(p.problems.errors(), 0) << text;
    EXPECT_NE(p.messages().find("which is taken as"), std::string::npos) << text;
  }
  Parsed p("\"integer i\" x1");
  EXPECT_EQ(p.list.integer("i", 7, 0, 10), 7);
  EXPECT_EQ(p.problems.errors(), 1);
}

TEST(Params, PointsNeedThreeNumbersEach) {
  Parsed p("\"point3 P\" [1 2 3 4]");
  EXPECT_EQ(*p.list.numbers("P", ParamType::kPoint3), (std::vector<double>{1, 2, 3}));
  EXPECT_NE(p.messages().find("multiple of 3; the last are left out"), std::string::npos);
}

TEST(Params, BadDeclarationDoesNotSwallowTheRest) {
  Parsed p("\"nonsense\" [1 2 3] \"float f\" 4");
  EXPECT_EQ(p.list.number("f", 0, 0, 10), 4);
  EXPECT_EQ(p.problems.errors(), 0);
  EXPECT_NE(p.messages().find("declared as \"type name\""), std::string::npos);
}

}  // namespace
}  // namespace lightmill
