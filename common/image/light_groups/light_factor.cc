#include "common/image/light_groups/light_factor.h"

#include <charconv>
#include <system_error>

namespace lightmill {

std::optional<LightFactor> light_factor_of_text(std::string_view text, char separator) {
  LightFactor factor{};
  size_t numbers = 0;
  const char *at = text.data(), *const end = at + text.size();
  for (;; ++at) {
    if (numbers == factor.size()) return std::nullopt;
    const auto [next, error] = std::from_chars(at, end, factor[numbers]);
    const bool inside = factor[numbers] >= 0 && factor[numbers] <= kLargestLightFactor;  // not NaN either
    if (error != std::errc() || !inside) return std::nullopt;
    ++numbers;
    at = next;
    if (at == end) break;
    if (*at != separator) return std::nullopt;
  }
  if (numbers == 1) factor[1] = factor[2] = factor[0];
  if (numbers == 2) return std::nullopt;
  return factor;
}

}  // namespace lightmill
