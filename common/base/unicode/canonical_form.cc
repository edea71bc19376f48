#include "common/base/unicode/canonical_form.h"

#include <algorithm>

#include "common/base/unicode/decompositions.h"

namespace lightmill {
namespace {

/// Of a character of the basic plane; those beyond have no decompositions here.
void append_utf8(char32_t c, std::string* out) {
  const auto byte = [&](char32_t x) { *out += static_cast<char>(x); };
  if (c < 0x80) {
    byte(c);
  } else if (c < 0x800) {
    byte(0xc0 | c >> 6);
    byte(0x80 | (c & 0x3f));
  } else {
    byte(0xe0 | c >> 12);
    byte(0x80 | (c >> 6 & 0x3f));
    byte(0x80 | (c & 0x3f));
  }
}

void append_decomposed(char32_t c, std::string* out) {
  // Hangul syllables follow a rule (the Unicode Standard, section 3.12).
  constexpr char32_t kSyllables = 0xac00, kLead = 0x1100, kVowel = 0x1161, kTail = 0x11a7;
  constexpr char32_t kVowels = 21, kTails = 28, kCount = 19 * kVowels * kTails;
  if (c >= kSyllables && c < kSyllables + kCount) {
    const char32_t index = c - kSyllables, tail = index % kTails;
    append_utf8(kLead + index / (kVowels * kTails), out);
    append_utf8(kVowel + index / kTails % kVowels, out);
    if (tail > 0) append_utf8(kTail + tail, out);
    return;
  }
  const auto found = std::ranges::lower_bound(kUnicodeDecompositions, static_cast<char16_t>(c), {},
                                              &UnicodeDecomposition::character);
  if (found == kUnicodeDecompositions.end() || found->character != c) return append_utf8(c, out);
  append_decomposed(found->first, out);
  if (found->second != 0) append_decomposed(found->second, out);
}

}  // namespace

std::string decomposed(std::string_view text) {
  std::string out;
  const auto continues = [&](size_t i) { return i < text.size() && (text[i] & 0xc0) == 0x80; };
  const auto bits = [&](size_t i, int mask) { return static_cast<char32_t>(text[i] & mask); };
  for (size_t at = 0; at < text.size();) {
    if ((text[at] & 0xe0) == 0xc0 && continues(at + 1)) {
      append_decomposed(bits(at, 0x1f) << 6 | bits(at + 1, 0x3f), &out);
      at += 2;
    } else if ((text[at] & 0xf0) == 0xe0 && continues(at + 1) && continues(at + 2)) {
      append_decomposed(bits(at, 0x0f) << 12 | bits(at + 1, 0x3f) << 6 | bits(at + 2, 0x3f), &out);
      at += 3;
    } else {
      out += text[at++];
    }
  }
  return out;
}

}  // namespace lightmill
