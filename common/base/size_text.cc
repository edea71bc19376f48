#include "common/base/size_text.h"

#include <charconv>
#include <cmath>

#include "common/base/error.h"

namespace lightmill {

uint64_t parse_size(const std::string& text, const std::string& option, uint64_t plain) {
  double value = 0;
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  std::string suffix(rest, end);
  if (suffix.size() == 2 && (suffix[1] == 'B' || suffix[1] == 'b')) suffix.pop_back();
  int power = -1;
  if (suffix.empty()) power = 0;
  if (suffix.size() == 1) {
    static constexpr char kSuffixes[] = "BKMGT";
    for (int i = 0; i < 5; ++i) {
      if ((suffix[0] & ~0x20) == kSuffixes[i]) power = i;
    }
  }
  const double bytes =
      suffix.empty() ? value * static_cast<double>(plain) : std::ldexp(value, 10 * std::max(power, 0));
  if (error != std::errc() || power < 0 || !(bytes >= 1) || bytes > 0x1p62) {
    throw Error(ErrorKind::kUsage, option + " " + text + ": expected a size such as 500M or 10G");
  }
  return static_cast<uint64_t>(bytes);
}

}  // namespace lightmill
