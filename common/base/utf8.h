#pragma once
// Text from outside: made valid UTF-8, and harmless where it is shown.
#include <string>
#include <string_view>

namespace lightmill {

/// Well-formed UTF-8: what JSON and protobuf can carry.
bool is_utf8(std::string_view text);
/// `text` with U+FFFD in place of each byte that is not UTF-8.
std::string valid_utf8(std::string_view text);
/// The first line of `text`, valid, cut to at most `most` bytes, never within a character. Control characters
/// become spaces, and what changes the direction of writing becomes U+FFFD: neither can command a terminal or
/// make a name read as another.
std::string printable_line(std::string_view text, size_t most);

}  // namespace lightmill
