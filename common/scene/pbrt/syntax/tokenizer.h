#pragma once
// Splits the text of a pbrt file into tokens: words, quoted strings and brackets. '#' starts a comment
// that runs to the end of the line. Every token knows its line and column (from 1, in bytes).
#include <deque>
#include <string>
#include <string_view>

#include "common/scene/problem_list.h"

namespace lightmill {

/// A position in a file; cheap to copy. `file` outlives every token.
struct TextPosition {
  const std::string* file = nullptr;
  int line = 1, column = 1;
  SourceLocation location() const { return {*file, line, column}; }
};

struct Token {
  enum class Kind { kWord, kString, kOpen, kClose, kEnd };
  Kind kind = Kind::kEnd;
  std::string_view text;  // a string's without quotes, escapes replaced
  TextPosition where;
};

class PbrtTokenizer {
 public:
  /// `file` (the name in messages) and `problems` must outlive the tokenizer and its tokens.
  PbrtTokenizer(std::string text, const std::string* file, ProblemList* problems);
  /// The same of a text that is not copied, and must outlive the tokenizer.
  struct Borrowed {
    std::string_view text;
  };
  PbrtTokenizer(Borrowed text, const std::string* file, ProblemList* problems);
  PbrtTokenizer(const PbrtTokenizer&) = delete;
  PbrtTokenizer& operator=(const PbrtTokenizer&) = delete;

  /// Parameters of the last directive may follow in the file that includes this one, after its Include, as
  /// pbrt's scenes have it: `Include "cloud.pbrt" "rgb sigma_a" [1 1 1]`. `outer` must outlive the tokenizer.
  void parameters_follow_in(PbrtTokenizer* outer) { outer_ = outer; }

  /// The next token, or kEnd forever. Token texts live as long as the tokenizer.
  Token next();
  const Token& peek();

 private:
  void begin(const std::string* file);
  Token scan();
  Token scan_outer();
  Token scan_string(Token token);
  void skip_blanks();
  void advance() {
    if (text_[at_] == '\n') {
      ++here_.line;
      here_.column = 0;
    }
    ++here_.column;
    ++at_;
  }

  const std::string owned_;
  std::string_view text_;
  size_t at_ = 0;
  TextPosition here_;
  ProblemList* problems_;
  std::deque<std::string> unescaped_;  // texts of strings that held escapes
  PbrtTokenizer* outer_ = nullptr;
  bool in_outer_ = false;  // what follows is the outer file's,
  int outer_depth_ = 0;    // inside so many brackets
  Token peeked_;
  bool has_peeked_ = false;
  bool said_comma_ = false;
};

}  // namespace lightmill
