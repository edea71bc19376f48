// Names that look alike.
#include "common/base/unicode/canonical_form.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/base/unicode/decompositions.h"

namespace lightmill {
namespace {

TEST(CanonicalForm, OfCharactersWithMarks) {
  EXPECT_EQ(decomposed("wood 1.png"), "wood 1.png");
  EXPECT_EQ(decomposed("\xc3\xa9"), "e\xcc\x81");  // e acute
  EXPECT_EQ(decomposed("e\xcc\x81"), "e\xcc\x81") << "is already";
  EXPECT_EQ(decomposed("\xe1\xba\xbf"), "e\xcc\x82\xcc\x81") << "two marks";         // U+1EBF
  EXPECT_EQ(decomposed("\xe2\x84\xab"), "A\xcc\x8a") << "another character, first";  // the Angstrom sign
  EXPECT_EQ(decomposed("\xea\xb0\x81"),
            "\xe1\x84\x80\xe1\x85\xa1\xe1\x86\xa8");                  // a Hangul syllable of three
  EXPECT_EQ(decomposed("\xea\xb0\x80"), "\xe1\x84\x80\xe1\x85\xa1");  // and of two letters
  EXPECT_EQ(decomposed("\xf0\x9f\x8c\xb2"), "\xf0\x9f\x8c\xb2") << "beyond the basic plane";
}

TEST(CanonicalForm, BytesThatAreNoUtf8Stay) {
  for (const char* text : {"\xc3", "a\xc3", "\xc3(", "\xe2\x84", "\x80\x81", "\xff\xfe"})
    EXPECT_EQ(decomposed(text), text);
}

TEST(CanonicalForm, TheTableIsSorted) {
  EXPECT_TRUE(std::ranges::is_sorted(kUnicodeDecompositions, {}, &UnicodeDecomposition::character));
}

}  // namespace
}  // namespace lightmill
