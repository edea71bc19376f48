#pragma once
// Bound on the nesting of JSON text from outside: values are written out again by recursion.
#include <string_view>

namespace lightmill {

/// Throws Error(kUsage) if arrays and objects nest deeper than `limit` levels.
void check_json_depth(std::string_view text, int limit);

}  // namespace lightmill
