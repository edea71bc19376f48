#pragma once
// Collects what a scene reader finds wrong, so that one run lists everything. Bounded: a broken file
// of any size yields at most kMaxErrors errors and kMaxWarnings warnings.
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/description.h"

namespace lightmill {

class ProblemList {
 public:
  static constexpr int kMaxErrors = 200;
  static constexpr int kMaxWarnings = 2000;

  /// `strict`: unsupported features count as errors.
  explicit ProblemList(bool strict) : strict_(strict) {}

  void error(const SourceLocation& where, const std::string& message);
  void warning(const SourceLocation& where, const std::string& message);
  /// A legal feature that is not there yet: "not supported yet: " + `what`.
  void unsupported(const SourceLocation& where, const std::string& what);

  int errors() const { return errors_; }
  /// So many errors that reading on helps nobody.
  bool full() const { return errors_ > kMaxErrors; }
  std::vector<Problem> take() { return std::move(problems_); }

 private:
  bool strict_;
  int errors_ = 0, warnings_ = 0;
  std::vector<Problem> problems_;
};

/// `"text"`, shortened and with unprintable bytes replaced: safe inside a one-line message.
std::string in_quotes(std::string_view text);
/// `; did you mean "x"?` for the candidate nearest to `word` by edit distance, or "" if none is near.
std::string nearest_hint(std::string_view word, const std::vector<std::string_view>& candidates);

}  // namespace lightmill
