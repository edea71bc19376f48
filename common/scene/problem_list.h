#pragma once
// Collects what a scene reader finds wrong, so that one run lists everything. Bounded: a broken file
// of any size yields at most kMaxErrors errors and kMaxWarnings warnings.
//
// A kind of warning is listed once, at its first place, with how many more there are. Two are of one kind if
// they differ in numbers alone, or in the name of `the material "..."`, `the mesh "..."` and so on.
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "common/scene/description.h"

namespace lightmill {

class ProblemList {
 public:
  static constexpr int kMaxErrors = 200;
  static constexpr int kMaxWarnings = 2000;

  /// `strict`: warnings count as errors.
  explicit ProblemList(bool strict) : strict_(strict) {}

  void error(const SourceLocation& where, const std::string& message);
  /// What is rendered otherwise than it is written; the message says how.
  void warning(const SourceLocation& where, const std::string& message);
  /// A legal feature that is not there yet: "not supported yet: " + `what`.
  void unsupported(const SourceLocation& where, const std::string& what);

  int errors() const { return errors_; }
  /// So many errors that reading on helps nobody.
  bool full() const { return errors_ > kMaxErrors; }
  /// All of them, in the order of their first places.
  std::vector<Problem> take();

 private:
  struct Kind {
    size_t first;  // in problems_
    int more = 0;
  };
  /// False if there has been such a message; it is then counted.
  bool is_new(const std::string& message);

  bool strict_;
  int errors_ = 0, warnings_ = 0;
  std::vector<Problem> problems_;
  std::unordered_map<std::string, Kind> kinds_;  // by what the messages of a kind share
};

/// `"text"`, shortened and with unprintable bytes replaced: safe inside a one-line message.
std::string in_quotes(std::string_view text);
/// `; did you mean "x"?` for the candidate nearest to `word` by edit distance, or "" if none is near.
std::string nearest_hint(std::string_view word, const std::vector<std::string_view>& candidates);
/// The same, and then what comes of it: `; did you mean "x"? It is left out`, or `; it is left out`.
std::string nearest_hint(std::string_view word, const std::vector<std::string_view>& candidates,
                         std::string consequence);

}  // namespace lightmill
