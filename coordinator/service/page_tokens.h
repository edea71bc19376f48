#pragma once
// Pages of lists (AIP-158): a token is a word and the number to go on from.
#include <algorithm>
#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/error.h"

namespace lightmill {

/// The number of a token, from `least` to `most`; empty for an empty one. Throws Error(kUsage) for a token
/// that no answer gave.
inline std::optional<int64_t> number_of_token(const std::string& token, std::string_view word, int64_t least,
                                              int64_t most) {
  if (token.empty()) return std::nullopt;
  int64_t number = 0;
  const char* const end = token.data() + token.size();
  if (token.starts_with(word)) {
    const auto [stop, error] = std::from_chars(token.data() + word.size(), end, number);
    if (error == std::errc() && stop == end && number >= least && number <= most) return number;
  }
  throw Error(ErrorKind::kUsage, "page_token is none that an answer gave; begin without one");
}

/// How many rows a request wants, at most so many; `most` where it doesn't say.
template <class Request>
size_t page_size(const Request& request, size_t most) {
  if (request.page_size() < 0) throw Error(ErrorKind::kUsage, "page_size must not be negative");
  return request.page_size() == 0 ? most : std::min(most, static_cast<size_t>(request.page_size()));
}

}  // namespace lightmill
