#include "common/scene/gltf/json.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/scene/problem_list.h"

namespace lightmill {
namespace {

using nlohmann::json;

constexpr size_t kMaxDepth = 64;
constexpr size_t kMaxValues = 50'000'000;

std::string range_text(double low, double high) {
  const auto shown = [](double x) {
    std::string text = json(x).dump();
    return text.ends_with(".0") ? text.substr(0, text.size() - 2) : text;
  };
  return "from " + shown(low) + " to " + shown(high);
}

/// "~" and "/" within a pointer's token (RFC 6901).
std::string escaped(const std::string& key) {
  std::string out;
  for (const char c : key) out += c == '~' ? "~0" : c == '/' ? "~1" : std::string(1, c);
  return out;
}

}  // namespace

void GltfValue::fail(const std::string& message) const { throw GltfProblem{pointer_, message}; }

std::optional<GltfValue> GltfValue::find(const char* key) const {
  if (!json_->is_object()) fail("must be an object");
  const auto found = json_->find(key);
  if (found == json_->end()) return std::nullopt;
  return GltfValue(*found, pointer_ + "/" + escaped(key));
}

GltfValue GltfValue::require(const char* key) const {
  auto value = find(key);
  if (!value) fail(std::string("needs \"") + key + "\"");
  return *value;
}

std::optional<GltfValue> GltfValue::extension(const char* name) const {
  const auto extensions = find("extensions");
  return extensions ? extensions->find(name) : std::nullopt;
}

std::vector<std::string> GltfValue::keys() const {
  if (!json_->is_object()) fail("must be an object");
  std::vector<std::string> keys;
  for (const auto& [key, value] : json_->items()) keys.push_back(key);
  return keys;
}

size_t GltfValue::size() const {
  if (!json_->is_array()) fail("must be an array");
  return json_->size();
}

GltfValue GltfValue::operator[](size_t i) const {
  if (i >= size()) fail("has no element " + std::to_string(i));
  return {(*json_)[i], pointer_ + "/" + std::to_string(i)};
}

size_t GltfValue::count(const char* key) const {
  const auto list = find(key);
  return list ? list->size() : 0;
}

double GltfValue::number(double low, double high) const {
  if (!json_->is_number()) fail("must be a number");
  const auto x = json_->get<double>();
  if (!(x >= low && x <= high)) fail("must be a number " + range_text(low, high));
  return x;
}

int64_t GltfValue::integer(int64_t low, int64_t high) const {
  const double x = number(static_cast<double>(low), static_cast<double>(high));
  if (x != std::floor(x)) fail("must be a whole number");
  return static_cast<int64_t>(x);
}

std::string GltfValue::text() const {
  if (!json_->is_string()) fail("must be a string");
  return json_->get<std::string>();
}

double GltfValue::number_or(const char* key, double fallback, double low, double high) const {
  const auto value = find(key);
  return value ? value->number(low, high) : fallback;
}

int64_t GltfValue::integer_or(const char* key, int64_t fallback, int64_t low, int64_t high) const {
  const auto value = find(key);
  return value ? value->integer(low, high) : fallback;
}

std::string GltfValue::text_or(const char* key, const std::string& fallback) const {
  const auto value = find(key);
  return value ? value->text() : fallback;
}

bool GltfValue::boolean_or(const char* key, bool fallback) const {
  const auto value = find(key);
  if (!value) return fallback;
  if (!value->json_->is_boolean()) value->fail("must be true or false");
  return value->json_->get<bool>();
}

std::vector<double> GltfValue::numbers_or(const char* key, std::vector<double> fallback, double low,
                                          double high) const {
  const auto value = find(key);
  if (!value) return fallback;
  if (value->size() != fallback.size())
    value->fail("must hold " + std::to_string(fallback.size()) + " numbers");
  for (size_t i = 0; i < fallback.size(); ++i) fallback[i] = (*value)[i].number(low, high);
  return fallback;
}

Rgb GltfValue::color_or(const char* key, const Rgb& fallback, double high) const {
  const auto c = numbers_or(key, {fallback.r, fallback.g, fallback.b}, 0, high);
  return {static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])};
}

int GltfValue::index_or_none(const char* key, size_t count, const char* what) const {
  const auto value = find(key);
  if (!value) return -1;
  const int64_t i = value->integer(0, (int64_t{1} << 31) - 1);
  if (static_cast<size_t>(i) >= count) {
    value->fail("refers to " + std::string(what) + " " + std::to_string(i) + ", but there are " +
                std::to_string(count));
  }
  return static_cast<int>(i);
}

namespace {

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
      const std::string key = open == '{' ? escaped(scan.string()) : std::to_string(i);
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

}  // namespace

json parse_gltf_json(const std::string& text, SourceLocation* where) {
  BoundsCheck check;
  if (!json::sax_parse(text, &check)) {
    *where = place_of(text, check.error_at, where->file);
    throw GltfProblem{"", check.problem};
  }
  json document = json::parse(text);
  if (!document.is_object()) throw GltfProblem{"", "a glTF file must be a JSON object"};
  return document;
}

}  // namespace lightmill
