#pragma once
// Names that look alike are spelled in two ways: "é" is one character, or "e" and a mark, as macOS writes it.
#include <string>
#include <string_view>

namespace lightmill {

/// `text` with characters in place of their canonical decompositions (Unicode's form NFD, but that marks keep
/// the order that they have). Bytes that are not UTF-8 stay as they are.
std::string decomposed(std::string_view text);

}  // namespace lightmill
