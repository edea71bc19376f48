#include "common/base/json_depth.h"

#include "common/base/error.h"

namespace lightmill {

void check_json_depth(std::string_view text, int limit) {
  int depth = 0;
  bool quoted = false;
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted) {
      if (c == '\\') ++i;
      if (c == '"') quoted = false;
    } else if (c == '"') {
      quoted = true;
    } else if (c == '[' || c == '{') {
      if (++depth > limit)
        throw Error(ErrorKind::kUsage, "JSON nested deeper than " + std::to_string(limit) + " levels");
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
}

}  // namespace lightmill
