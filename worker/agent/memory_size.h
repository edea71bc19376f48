#pragma once
// Options that bound memory.
#include <cstdint>
#include <string>

namespace lightmill::agent {

/// Bytes of "500M" or "2G", where a plain number is of MiB; "none" is no bound (the largest number), "auto"
/// half of usual_memory_limit(). Throws Error(kUsage) that names `option`.
uint64_t parse_memory(const std::string& text, const std::string& option);

}  // namespace lightmill::agent
