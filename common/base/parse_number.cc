#include "common/base/parse_number.h"

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <string>

namespace lightmill {

bool parse_number(std::string_view text, double* value) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), *value);
  if (error == std::errc::invalid_argument || end != text.data() + text.size()) return false;
  // from_chars calls underflow "out of range" too; strtod tells it from overflow.
  if (error == std::errc::result_out_of_range) *value = std::strtod(std::string(text).c_str(), nullptr);
  return std::isfinite(*value);
}

}  // namespace lightmill
