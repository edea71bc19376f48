#pragma once
// Letters of ASCII without capitals, whatever the locale.
#include <string>

namespace lightmill {

inline char lower_case(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }
inline std::string lower_case(std::string text) {
  for (char& c : text) c = lower_case(c);
  return text;
}

}  // namespace lightmill
