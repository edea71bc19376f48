// The text of a glTF file's JSON: its bounds, and where in it a value is.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "common/base/lower_case.h"
#include "common/scene/gltf/json/json.h"

namespace lightmill {
namespace {

using nlohmann::json;

constexpr size_t kMaxDepth = 64;
constexpr size_t kMaxValues = 50'000'000;

SourceLocation place_of(const std::string& text, size_t offset, const std::string& file) {
  offset = std::min(offset, text.size());
  const auto end = text.begin() + static_cast<std::ptrdiff_t>(offset);
  const size_t line_start = offset == 0 ? std::string::npos : text.rfind('\n', offset - 1);
  const size_t column = line_start == std::string::npos ? offset : offset - line_start - 1;
  // Files may be one line of gigabytes: what does not fit is said as well as an int can.
  const auto number = [](size_t n) { return static_cast<int>(std::min<size_t>(n, 2'000'000'000)) + 1; };
  return {file, number(static_cast<size_t>(std::count(text.begin(), end, '\n'))), number(column)};
}

/// Walks valid JSON text without building anything.
class Scanner {
 public:
  explicit Scanner(const std::string& text) : text_(text) {}

  void skip_space() {
    while (at_ < text_.size() && std::string_view(" \t\r\n").find(text_[at_]) != std::string_view::npos)
      ++at_;
  }
  char peek() {
    skip_space();
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  size_t offset() const { return at_; }
  void advance() { ++at_; }

  /// The raw characters between the quotes.
  std::string string() {
    const size_t begin = ++at_;
    while (at_ < text_.size() && text_[at_] != '"') at_ += text_[at_] == '\\' ? 2 : 1;
    at_ = std::min(at_, text_.size());
    std::string raw = text_.substr(begin, at_ - begin);
    ++at_;
    return raw;
  }
  void skip_value() {
    size_t depth = 0;
    do {
      const char c = peek();
      if (c == '\0') return;
      if (c == '"') {
        string();
      } else {
        depth += c == '{' || c == '[' ? 1 : 0;
        depth -= (c == '}' || c == ']') && depth > 0 ? 1 : 0;
        ++at_;
        if (depth == 0 && c != '}' && c != ']') {
          while (at_ < text_.size() &&
                 std::string_view(",]} \t\r\n").find(text_[at_]) == std::string_view::npos)
            ++at_;
        }
      }
    } while (depth > 0);
  }

 private:
  const std::string& text_;
  size_t at_ = 0;
};

}  // namespace

SourceLocation locate_in_json(const std::string& text, const std::string& pointer, const std::string& file) {
  Scanner scan(text);
  scan.skip_space();
  size_t found = scan.offset();
  for (size_t begin = 1; begin <= pointer.size() && !pointer.empty();) {
    const size_t end = std::min(pointer.find('/', begin), pointer.size());
    const std::string token = pointer.substr(begin, end - begin);
    begin = end + 1;
    const char open = scan.peek();
    if (open != '{' && open != '[') break;
    scan.advance();
    bool inside = false;
    for (size_t i = 0; scan.peek() != '}' && scan.peek() != ']' && scan.peek() != '\0'; ++i) {
      const size_t key_at = scan.offset();
      const std::string key = open == '{' ? json_pointer_token(scan.string()) : std::to_string(i);
      if (open == '{' && scan.peek() == ':') scan.advance();
      if (key == token) {
        scan.skip_space();
        found = open == '{' ? key_at : scan.offset();
        inside = true;
        break;
      }
      scan.skip_value();
      if (scan.peek() == ',') scan.advance();
    }
    if (!inside) break;
  }
  return place_of(text, found, file);
}

namespace {

/// Reads without building anything: bounds, and the place of a syntax error.
class BoundsCheck : public nlohmann::json_sax<json> {
 public:
  size_t error_at = 0;
  std::string problem;  // empty: none

  bool null() override { return count(); }
  bool boolean(bool) override { return count(); }
  bool number_integer(number_integer_t) override { return count(); }
  bool number_unsigned(number_unsigned_t) override { return count(); }
  bool number_float(number_float_t, const string_t&) override { return count(); }
  bool string(string_t&) override { return count(); }
  bool binary(binary_t&) override { return count(); }
  bool key(string_t&) override { return true; }
  bool start_object(size_t) override { return enter(); }
  bool start_array(size_t) override { return enter(); }
  bool end_object() override { return depth_-- > 0; }
  bool end_array() override { return depth_-- > 0; }
  bool parse_error(size_t position, const std::string&, const nlohmann::detail::exception& e) override {
    error_at = position > 0 ? position - 1 : 0;
    // By its documented number: a number that double can't hold.
    problem =
        e.id == 406 ? "the JSON holds a number that is out of range" : "the JSON is damaged or cut off here";
    return false;
  }

 private:
  bool count() {
    return ++values_ <= kMaxValues || refuse("has more than " + std::to_string(kMaxValues) + " values");
  }
  bool enter() {
    return (++depth_ <= kMaxDepth ||
            refuse("is nested deeper than " + std::to_string(kMaxDepth) + " levels")) &&
           count();
  }
  bool refuse(const std::string& what) {
    problem = "the JSON " + what;
    return false;
  }
  size_t depth_ = 0, values_ = 0;
};

/// What stands for a word that other programs write in a number's place; nullptr if it is none of those.
const char* finite_number(std::string_view word) {
  const bool negative = word.starts_with('-');
  const std::string plain = lower_case(std::string(word.substr(negative || word.starts_with('+') ? 1 : 0)));
  if (plain == "nan") return "0";
  const char* const most = negative ? "-3.4e38" : "3.4e38";
  if (plain == "inf" || plain == "infinity") return most;
  if (plain.empty() || plain[0] < '0' || plain[0] > '9') return nullptr;
  char* end = nullptr;
  const double value = std::strtod(plain.c_str(), &end);
  return *end == '\0' && std::isinf(value) ? most : nullptr;
}

/// The text with finite numbers in place of NaN, Infinity and 1e999, which are warned of.
std::string with_finite_numbers(const std::string& text, const std::string& file, ProblemList* problems) {
  constexpr std::string_view kEnds = ",:[]{}\" \t\r\n";
  std::string out;
  constexpr int kMostWarnings = 1000;
  std::optional<SourceLocation> first;
  int words = 0;
  for (size_t at = 0; at < text.size();) {
    size_t end = at + 1;
    const char* number = nullptr;
    if (text[at] == '"') {
      while (end < text.size() && text[end] != '"') end += text[end] == '\\' ? 2 : 1;
      end = std::min(end + 1, text.size());
    } else if (kEnds.find(text[at]) == std::string_view::npos) {
      end = std::min(text.find_first_of(kEnds, at), text.size());
      const std::string_view word = std::string_view(text).substr(at, end - at);
      number = finite_number(word);
      if (number != nullptr) {
        if (!first) first = place_of(text, at, file);
        if (++words <= kMostWarnings)
          problems->warning(*first, "the JSON holds " + in_quotes(word) + ", which is no finite number; " +
                                        number + " is taken");
      }
    }
    if (number == nullptr) {
      out.append(text, at, end - at);
    } else {
      out += number;
    }
    at = end;
  }
  return out;
}

json object_in(const std::string& valid) {
  json document = json::parse(valid);
  if (!document.is_object()) throw GltfProblem{"", "a glTF file must be a JSON object"};
  return document;
}

}  // namespace

json parse_gltf_json(const std::string& text, SourceLocation* where, ProblemList* problems) {
  BoundsCheck check;
  if (json::sax_parse(text, &check)) return object_in(text);
  BoundsCheck of_mended;
  const std::string mended = with_finite_numbers(text, where->file, problems);
  if (mended != text && json::sax_parse(mended, &of_mended)) return object_in(mended);
  *where = place_of(text, check.error_at, where->file);
  throw GltfProblem{"", check.problem};
}

}  // namespace lightmill
