#include "worker/agent/memory_size.h"

#include <limits>

#include "common/base/size_text.h"
#include "common/sandbox/sandbox.h"

namespace lightmill::agent {

uint64_t parse_memory(const std::string& text, const std::string& option) {
  if (text == "none") return std::numeric_limits<uint64_t>::max();
  return text == "auto" ? usual_memory_limit() / 2 : parse_size(text, option, 1 << 20);
}

}  // namespace lightmill::agent
