#pragma once
// Which pbrt a scene file was written for. All of them end in .pbrt, and none says which it is: words tell.
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace lightmill {

/// kV3 stands for pbrt-v2 as well, as far as that is the same.
enum class Dialect { kV4, kV3 };

/// "pbrt-v4" or "pbrt-v3".
const char* dialect_name(Dialect dialect);

/// The dialect of the first word of `text` that only one of them has; nothing if there is none. `include` is
/// called with the files that come before it.
std::optional<Dialect> dialect_of(std::string_view text,
                                  const std::function<void(const std::string& file)>& include);

}  // namespace lightmill
