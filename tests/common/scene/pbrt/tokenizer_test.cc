#include "common/scene/pbrt/syntax/tokenizer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/base/parse_number.h"

namespace lightmill {
namespace {

struct Scan {
  explicit Scan(const std::string& text) : tokenizer(text, &file, &problems) {}
  std::string file = "a.pbrt";
  ProblemList problems{false};
  PbrtTokenizer tokenizer;
};

using Kind = Token::Kind;

void expect(const Token& token, Kind kind, const std::string& text, int line, int column) {
  EXPECT_EQ(token.kind, kind) << text;
  EXPECT_EQ(token.text, text);
  EXPECT_EQ(token.where.line, line) << text;
  EXPECT_EQ(token.where.column, column) << text;
}

TEST(Tokenizer, KindsAndPositions) {
  Scan s("Shape \"sphere\" # a comment [ \"\n  \"float radius\"[1.5e3]\r\nEnd");
  expect(s.tokenizer.next(), Kind::kWord, "Shape", 1, 1);
  expect(s.tokenizer.next(), Kind::kString, "sphere", 1, 7);
  expect(s.tokenizer.next(), Kind::kString, "float radius", 2, 3);
  expect(s.tokenizer.next(), Kind::kOpen, "[", 2, 17);
  expect(s.tokenizer.next(), Kind::kWord, "1.5e3", 2, 18);
  expect(s.tokenizer.next(), Kind::kClose, "]", 2, 23);
  expect(s.tokenizer.next(), Kind::kWord, "End", 3, 1);
  EXPECT_EQ(s.tokenizer.next().kind, Kind::kEnd);
  EXPECT_EQ(s.tokenizer.next().kind, Kind::kEnd);
  EXPECT_EQ(s.problems.errors(), 0);
}

TEST(Tokenizer, PeekDoesNotConsume) {
  Scan s("a b");
  EXPECT_EQ(s.tokenizer.peek().text, "a");
  EXPECT_EQ(s.tokenizer.next().text, "a");
  EXPECT_EQ(s.tokenizer.next().text, "b");
}

TEST(Tokenizer, Escapes) {
  Scan s(R"("a\"b\\c\n\t" "plain")");
  EXPECT_EQ(s.tokenizer.next().text, "a\"b\\c\n\t");
  EXPECT_EQ(s.tokenizer.next().text, "plain");
  EXPECT_EQ(s.problems.errors(), 0);
}

TEST(Tokenizer, UnknownEscapeIsReported) {
  Scan s(R"("a\q")");
  s.tokenizer.next();
  EXPECT_EQ(s.problems.errors(), 1);
}

TEST(Tokenizer, UnterminatedStringEndsWithItsLine) {
  Scan s("\"abc\nShape");
  EXPECT_EQ(s.tokenizer.next().text, "abc");
  expect(s.tokenizer.next(), Kind::kWord, "Shape", 2, 1);
  EXPECT_EQ(s.problems.errors(), 1);
  Scan cut("\"abc\\");
  cut.tokenizer.next();
  EXPECT_EQ(cut.tokenizer.next().kind, Kind::kEnd);
  EXPECT_EQ(cut.problems.errors(), 1);
}

TEST(Tokenizer, ByteOrderMarkIsSkipped) {
  Scan s("\xef\xbb\xbfWord");
  EXPECT_EQ(s.tokenizer.next().text, "Word");
}

TEST(Numbers, Accepted) {
  const std::pair<const char*, double> cases[] = {{"1", 1},
                                                  {"-1", -1},
                                                  {"+1.5", 1.5},
                                                  {".5", 0.5},
                                                  {"5.", 5},
                                                  {"1e3", 1e3},
                                                  {"-2.5E-2", -0.025},
                                                  {"1e-400", 0},
                                                  {"4.37114e-8", 4.37114e-8}};
  for (const auto& [text, value] : cases) {
    double parsed = 99;
    EXPECT_TRUE(parse_number(text, &parsed)) << text;
    EXPECT_DOUBLE_EQ(parsed, value) << text;
  }
}

TEST(Numbers, Refused) {
  for (const char* text :
       {"", "+", "-", "abc", "1x", "1e", "nan", "inf", "-inf", "1e999", "+-1", "0x10", "1 "}) {
    double parsed = 0;
    EXPECT_FALSE(parse_number(text, &parsed)) << text;
  }
}

TEST(Hints, NearestName) {
  EXPECT_EQ(nearest_hint("reflectence", {"roughness", "reflectance"}), "; did you mean \"reflectance\"?");
  EXPECT_EQ(nearest_hint("zzzzzz", {"roughness", "reflectance"}), "");
  EXPECT_EQ(nearest_hint(std::string(100000, 'a'), {"a"}), "");
}

TEST(Problems, AreBounded) {
  ProblemList list(false);
  for (int i = 0; i < 100000; ++i) {
    list.error({"f", i, 1}, "e");
    list.warning({"f", i, 1}, "w");
  }
  EXPECT_TRUE(list.full());
  EXPECT_LE(list.take().size(), static_cast<size_t>(ProblemList::kMaxErrors + ProblemList::kMaxWarnings));
}

TEST(Problems, StrictMakesUnsupportedAnError) {
  ProblemList lax(false), strict(true);
  lax.unsupported({"f", 1, 1}, "x is ignored");
  strict.unsupported({"f", 1, 1}, "x is ignored");
  EXPECT_EQ(lax.errors(), 0);
  EXPECT_EQ(strict.errors(), 1);
}

TEST(Problems, QuotesAreSafeToPrint) {
  EXPECT_EQ(in_quotes("a\nb\x01"), "\"a?b?\"");
  EXPECT_LT(in_quotes(std::string(10000, 'x')).size(), 80u);
}

}  // namespace
}  // namespace lightmill
