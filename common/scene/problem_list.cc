#include "common/scene/problem_list.h"

#include <algorithm>
#include <numeric>

namespace lightmill {

void ProblemList::error(const SourceLocation& where, const std::string& message) {
  ++errors_;
  if (errors_ < kMaxErrors) problems_.push_back({where, Severity::kError, message});
  if (errors_ == kMaxErrors) {
    problems_.push_back({where, Severity::kError, "too many errors; mend those above first"});
  }
}

void ProblemList::warning(const SourceLocation& where, const std::string& message) {
  ++warnings_;
  if (warnings_ < kMaxWarnings) problems_.push_back({where, Severity::kWarning, message});
  if (warnings_ == kMaxWarnings) {
    problems_.push_back({where, Severity::kWarning, "too many warnings; further ones are not listed"});
  }
}

void ProblemList::unsupported(const SourceLocation& where, const std::string& what) {
  const std::string message = "not supported yet: " + what;
  if (strict_) {
    error(where, message);
  } else {
    warning(where, message);
  }
}

std::string in_quotes(std::string_view text) {
  constexpr size_t kMaxShown = 60;
  std::string out = "\"";
  for (char c : text.substr(0, kMaxShown)) {
    const auto byte = static_cast<unsigned char>(c);
    out += byte < 0x20 || byte == 0x7f ? '?' : c;
  }
  if (text.size() > kMaxShown) out += "...";
  return out + "\"";
}

namespace {

size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row[b.size()];
}

}  // namespace

std::string nearest_hint(std::string_view word, const std::vector<std::string_view>& candidates) {
  constexpr size_t kLongestWord = 64;  // nobody mistypes a name into more than this
  if (word.size() > kLongestWord) return "";
  std::string_view best;
  size_t best_distance = word.size() / 3 + 1;  // at most about a third of the letters wrong
  for (std::string_view candidate : candidates) {
    const size_t distance = edit_distance(word, candidate);
    if (distance <= best_distance && (best.empty() || distance < best_distance)) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best.empty() ? "" : "; did you mean \"" + std::string(best) + "\"?";
}

}  // namespace lightmill
