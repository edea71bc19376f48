#include "common/scene/problem_list.h"

#include <algorithm>
#include <numeric>

namespace lightmill {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// What messages of a kind share: numbers become 0, and the name after `the WORD ` goes.
std::string kind_of(const std::string& message) {
  std::string kind;
  size_t at = 0;
  const auto is_named = [&] {  // kind ends in "the WORD "
    if (kind.size() < 6 || kind.back() != ' ') return false;
    const size_t word = kind.find_last_of(' ', kind.size() - 2);
    return word != std::string::npos && word >= 3 && kind.compare(word - 3, 3, "the") == 0;
  };
  while (at < message.size()) {
    const char c = message[at];
    if (c == '"' && is_named()) {
      const size_t end = message.find('"', at + 1);
      at = end == std::string::npos ? message.size() : end + 1;
    } else if (is_digit(c)) {
      while (at < message.size() && (is_digit(message[at]) || message[at] == '.')) ++at;
      kind += '0';
    } else {
      kind += c;
      ++at;
    }
  }
  return kind;
}

}  // namespace

bool ProblemList::is_new(const std::string& message) {
  const auto [known, is_first] = kinds_.try_emplace(kind_of(message), Kind{problems_.size()});
  if (!is_first) ++known->second.more;
  return is_first;
}

std::vector<Problem> ProblemList::take() {
  for (const auto& [key, kind] : kinds_) {
    if (kind.more > 0)
      problems_[kind.first].message += ", and " + std::to_string(kind.more) + " more like it";
  }
  kinds_.clear();
  return std::move(problems_);
}

void ProblemList::error(const SourceLocation& where, const std::string& message) {
  ++errors_;
  if (errors_ < kMaxErrors) problems_.push_back({where, Severity::kError, message});
  if (errors_ == kMaxErrors) {
    problems_.push_back({where, Severity::kError, "too many errors; mend those above first"});
  }
}

void ProblemList::warning(const SourceLocation& where, const std::string& message) {
  if (strict_) return error(where, message);
  if (warnings_ >= kMaxWarnings || !is_new(message)) return;
  ++warnings_;
  if (warnings_ < kMaxWarnings) problems_.push_back({where, Severity::kWarning, message});
  if (warnings_ == kMaxWarnings) {
    problems_.push_back({where, Severity::kWarning, "too many warnings; further ones are not listed"});
  }
}

void ProblemList::unsupported(const SourceLocation& where, const std::string& what) {
  warning(where, "not supported yet: " + what);
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

std::string nearest_hint(std::string_view word, const std::vector<std::string_view>& candidates,
                         std::string consequence) {
  const std::string hint = nearest_hint(word, candidates);
  if (hint.empty()) return "; " + consequence;
  if (consequence[0] >= 'a' && consequence[0] <= 'z') consequence[0] = static_cast<char>(consequence[0] - 32);
  return hint + " " + consequence;
}

}  // namespace lightmill
