#pragma once
// What libraries say, as a part of one of our lines.
#include <algorithm>
#include <string>

namespace lightmill {

/// Theirs may span lines; ours is one.
inline std::string library_message(std::string message) {
  std::replace(message.begin(), message.end(), '\n', ' ');
  while (!message.empty() && message.back() == ' ') message.pop_back();
  return message.empty() ? "unknown error" : message;
}

}  // namespace lightmill
