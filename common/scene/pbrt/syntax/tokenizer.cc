#include "common/scene/pbrt/syntax/tokenizer.h"

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace lightmill {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\f' || c == '\v'; }
bool ends_word(char c) { return is_blank(c) || c == '"' || c == '[' || c == ']' || c == '#' || c == ','; }

/// The character that `\c` stands for, or 0 if that is no escape.
char unescape(char c) {
  switch (c) {
    case 'b':
      return '\b';
    case 'f':
      return '\f';
    case 'n':
      return '\n';
    case 'r':
      return '\r';
    case 't':
      return '\t';
    case '\\':
      return '\\';
    case '\'':
      return '\'';
    case '"':
      return '"';
    default:
      return 0;
  }
}

}  // namespace

PbrtTokenizer::PbrtTokenizer(std::string text, const std::string* file, ProblemList* problems)
    : owned_(std::move(text)), text_(owned_), problems_(problems) {
  begin(file);
}

PbrtTokenizer::PbrtTokenizer(Borrowed text, const std::string* file, ProblemList* problems)
    : text_(text.text), problems_(problems) {
  begin(file);
}

void PbrtTokenizer::begin(const std::string* file) {
  here_.file = file;
  if (text_.starts_with("\xef\xbb\xbf")) at_ = 3;  // UTF-8 byte order mark
}

Token PbrtTokenizer::next() {
  if (has_peeked_) {
    has_peeked_ = false;
    return peeked_;
  }
  return scan();
}

const Token& PbrtTokenizer::peek() {
  if (!has_peeked_) {
    peeked_ = scan();
    has_peeked_ = true;
  }
  return peeked_;
}

void PbrtTokenizer::skip_blanks() {
  while (at_ < text_.size()) {
    if (text_[at_] == '#') {
      while (at_ < text_.size() && text_[at_] != '\n') advance();
    } else if (is_blank(text_[at_])) {
      advance();
    } else if (text_[at_] == ',') {
      if (!std::exchange(said_comma_, true))
        problems_->warning(here_.location(), "commas stand between values; they are passed over");
      advance();
    } else {
      return;
    }
  }
}

Token PbrtTokenizer::scan() {
  skip_blanks();
  Token token;
  token.where = here_;
  if (at_ == text_.size()) return outer_ == nullptr ? token : scan_outer();
  const size_t begin = at_;
  const char c = text_[at_];
  if (c == '"') return scan_string(token);
  if (c == '[' || c == ']') {
    token.kind = c == '[' ? Token::Kind::kOpen : Token::Kind::kClose;
    advance();
  } else {
    token.kind = Token::Kind::kWord;
    // "1.#IND" and "1.#INF" are numbers of Microsoft's C library, not comments.
    const auto is_odd_number = [&] {
      return text_[at_] == '#' && at_ >= begin + 2 && text_[at_ - 1] == '.' && text_[at_ - 2] == '1';
    };
    while (at_ < text_.size() && (!ends_word(text_[at_]) || is_odd_number())) advance();
  }
  token.text = text_.substr(begin, at_ - begin);
  return token;
}

Token PbrtTokenizer::scan_outer() {
  const Token& token = outer_->peek();
  const bool is_directive =
      token.kind == Token::Kind::kWord && outer_depth_ == 0 && token.text[0] >= 'A' && token.text[0] <= 'Z';
  if ((!in_outer_ && token.kind != Token::Kind::kString) || is_directive || token.kind == Token::Kind::kEnd) {
    Token end;
    end.where = here_;
    return end;
  }
  in_outer_ = true;
  if (token.kind == Token::Kind::kOpen) ++outer_depth_;
  if (token.kind == Token::Kind::kClose) --outer_depth_;
  return outer_->next();
}

Token PbrtTokenizer::scan_string(Token token) {
  token.kind = Token::Kind::kString;
  advance();
  const size_t begin = at_;
  bool escapes = false;
  while (at_ < text_.size() && text_[at_] != '"' && text_[at_] != '\n') {
    if (text_[at_] == '\\' && at_ + 1 < text_.size() && text_[at_ + 1] != '\n') {
      escapes = true;
      advance();
    }
    advance();
  }
  const std::string_view raw = text_.substr(begin, at_ - begin);
  if (at_ < text_.size() && text_[at_] == '"') {
    advance();
  } else {
    problems_->error(token.where.location(),
                     "unterminated string " + in_quotes(raw) + ": add the closing quote");
  }
  token.text = raw;
  if (!escapes) return token;

  std::string& plain = unescaped_.emplace_back();
  for (size_t i = 0; i < raw.size(); ++i) {
    if (raw[i] != '\\' || i + 1 == raw.size()) {
      plain += raw[i];
      continue;
    }
    const char replaced = unescape(raw[++i]);
    if (replaced == 0) {
      problems_->error(token.where.location(), "unknown escape \\" + std::string(1, raw[i]) +
                                                   " in the string " + in_quotes(raw) +
                                                   "; write \\\\ for a backslash");
    }
    plain += replaced == 0 ? raw[i] : replaced;
  }
  token.text = plain;
  return token;
}

}  // namespace lightmill
