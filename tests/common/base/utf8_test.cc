#include "common/base/utf8.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

TEST(Utf8, TellsWhatIsValid) {
  for (const char* text : {"", "a", "\xc3\xa9", "\xe2\x82\xac", "\xf0\x9f\x98\x80"})
    EXPECT_TRUE(is_utf8(text)) << text;
  // Latin-1, an overlong form, a surrogate, beyond U+10FFFF, cut short.
  for (const char* text : {"caf\xe9", "\xc0\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xe2\x82"})
    EXPECT_FALSE(is_utf8(text)) << text;
}

TEST(Utf8, ReplacesWhatIsNot) {
  EXPECT_EQ(valid_utf8("caf\xe9 \xe2\x82\xac"), "caf\xef\xbf\xbd \xe2\x82\xac");
  EXPECT_EQ(valid_utf8("\xe2\x82"), "\xef\xbf\xbd\xef\xbf\xbd");
}

TEST(Utf8, LinesCommandNoTerminal) {
  EXPECT_EQ(printable_line("a\x1b[31mb\tc\nd", 100), "a [31mb c");
  EXPECT_EQ(printable_line("a\xc2\x9b"
                           "31m",
                           100),
            "a 31m");                                                            // C1
  EXPECT_EQ(printable_line("exe.\xe2\x80\xaegpj", 100), "exe.\xef\xbf\xbdgpj");  // right-to-left override
  EXPECT_EQ(printable_line("\xe2\x81\xa6x", 100), "\xef\xbf\xbdx");
  EXPECT_EQ(printable_line("\xd7\xa9\xd7\x9c", 100), "\xd7\xa9\xd7\x9c");  // Hebrew letters stay
}

TEST(Utf8, LinesAreCutBetweenCharacters) {
  EXPECT_EQ(printable_line("aa\xe2\x82\xac", 4), "aa");
  EXPECT_EQ(printable_line("aa\xe2\x82\xac", 5), "aa\xe2\x82\xac");
}

}  // namespace
}  // namespace lightmill
