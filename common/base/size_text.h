#pragma once
// Sizes as people write them.
#include <cstdint>
#include <string>

namespace lightmill {

/// Bytes of "500M", "10G", "1T" (powers of 1024; also K, or a plain number of `plain` bytes). Throws
/// Error(kUsage) that names `option`.
uint64_t parse_size(const std::string& text, const std::string& option, uint64_t plain = 1);

}  // namespace lightmill
