#include "common/base/json/json_depth.h"

#include "common/base/error.h"

namespace lightmill {

void check_json_depth(std::string_view text, int limit) { check_json_size(text, limit, text.size()); }

void check_json_size(std::string_view text, int limit, size_t most) {
  int depth = 0;
  size_t values = 0;
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
    if (!quoted && (c == '[' || c == '{' || c == ',') && ++values > most)
      throw Error(ErrorKind::kUsage, "JSON of more than " + std::to_string(most) + " values");
  }
}

}  // namespace lightmill
