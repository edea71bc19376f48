#pragma once
// Bounds of JSON text from outside, checked before it is unpacked: values are written out again by recursion,
// and each takes many times the memory of its text.
#include <string_view>

namespace lightmill {

/// Throws Error(kUsage) if arrays and objects nest deeper than `limit` levels.
void check_json_depth(std::string_view text, int limit);
/// The same, and if there are more than `most` values, by the commas and brackets between them.
void check_json_size(std::string_view text, int limit, size_t most);

}  // namespace lightmill
