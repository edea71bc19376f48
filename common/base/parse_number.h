#pragma once
// Numbers in text files of scenes.
#include <string_view>

namespace lightmill {

/// Parses a finite decimal number that makes up the whole of `text` (from_chars' grammar and a leading +).
/// False if it is none, or is not finite in double.
bool parse_number(std::string_view text, double* value);

}  // namespace lightmill
