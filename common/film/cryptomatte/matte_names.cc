#include "common/film/cryptomatte/matte_names.h"

#include <utility>

#include "common/base/utf8.h"
#include "common/image/cryptomatte/cryptomatte_hash.h"

namespace lightmill {

std::string matte_name(std::string_view text) {
  constexpr size_t kHashBytes = 9;  // "~" and 8 digits
  if (text.empty()) return kUnnamedMatte;
  std::string name = printable_line(text, text.size() * 3);  // U+FFFD takes three bytes
  if (name.size() > kMaxMatteName)
    name = printable_line(name, kMaxMatteName - kHashBytes) + "~" + cryptomatte_hex(text);
  return name.empty() ? kUnnamedMatte : name;
}

bool valid_matte_name(std::string_view name) {
  return !name.empty() && name.size() <= kMaxMatteName && printable_line(name, kMaxMatteName) == name;
}

uint32_t MatteNames::number(std::string_view text) {
  std::string name = matte_name(text);
  if (const auto found = numbers_.find(name); found != numbers_.end()) return found->second;
  // There is always room for kOtherMatte.
  constexpr size_t kKeptBytes = std::string_view(kOtherMatte).size();
  if (names_.size() + 1 < kMaxMatteNames && text_bytes_ + name.size() + kKeptBytes <= kMaxMatteText)
    return add(std::move(name));
  ++left_out_;
  const auto other = numbers_.find(kOtherMatte);
  return other != numbers_.end() ? other->second : add(kOtherMatte);
}

uint32_t MatteNames::add(std::string name) {
  const auto number = static_cast<uint32_t>(names_.size());
  text_bytes_ += name.size();
  numbers_.emplace(name, number);
  names_.push_back(std::move(name));
  return number;
}

}  // namespace lightmill
