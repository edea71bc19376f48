#include "common/scene/pbrt/params.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

#include "common/base/lower_case.h"
#include "common/base/parse_number.h"
#include "common/scene/pbrt/coerce.h"

namespace lightmill {
namespace {

struct TypeName {
  std::string_view name;
  ParamType type;
};
// The first name of a type is the one used in messages; the others are pbrt's synonyms.
constexpr TypeName kTypeNames[] = {
    {"integer", ParamType::kInteger},   {"float", ParamType::kFloat},
    {"point2", ParamType::kPoint2},     {"vector2", ParamType::kVector2},
    {"point3", ParamType::kPoint3},     {"vector3", ParamType::kVector3},
    {"normal", ParamType::kNormal},     {"bool", ParamType::kBool},
    {"string", ParamType::kString},     {"rgb", ParamType::kRgb},
    {"spectrum", ParamType::kSpectrum}, {"blackbody", ParamType::kBlackbody},
    {"texture", ParamType::kTexture},   {"point", ParamType::kPoint3},
    {"vector", ParamType::kVector3},    {"normal3", ParamType::kNormal},
    {"color", ParamType::kRgb},         {"xyz", ParamType::kXyz},
};

size_t components(ParamType type) {
  switch (type) {
    case ParamType::kPoint2:
    case ParamType::kVector2:
      return 2;
    case ParamType::kPoint3:
    case ParamType::kVector3:
    case ParamType::kNormal:
    case ParamType::kRgb:
    case ParamType::kXyz:
      return 3;
    default:
      return 1;
  }
}

/// What "nan", "inf" and the like of other programs stand for in a number's place.
std::optional<double> odd_number(std::string_view text) {
  std::string word;
  for (const char c : text) word += lower_case(c);
  const bool negative = word.starts_with('-');
  if (negative || word.starts_with('+')) word.erase(0, 1);
  if (word.starts_with("inf") || word.starts_with("1.#inf")) return negative ? -kAnySize : kAnySize;
  if (word.starts_with("nan") || word.starts_with("1.#ind") || word.starts_with("1.#qnan")) return 0;
  // Beyond double, as 1e400: parse_number takes finite numbers alone.
  char* end = nullptr;
  const double value = std::strtod(word.c_str(), &end);
  if (end != word.c_str() + word.size() || word.empty() || !(word[0] >= '0' && word[0] <= '9')) return {};
  return std::isfinite(value) ? std::nullopt : std::optional(negative ? -kAnySize : kAnySize);
}

bool takes_strings(ParamType type) { return type == ParamType::kString || type == ParamType::kTexture; }

std::string shown(const Token& token) {
  switch (token.kind) {
    case Token::Kind::kEnd:
      return "the end of the file";
    case Token::Kind::kString:
      return "the string " + in_quotes(token.text);
    default:
      return in_quotes(token.text);
  }
}

std::string plain(double x) {
  std::string s = std::to_string(x);
  if (s.find('.') != std::string::npos) {
    s.erase(s.find_last_not_of('0') + 1);
    if (s.back() == '.') s.pop_back();
  }
  return s;
}

/// Splits "type name"; reports and returns false if the string is none.
bool parse_declaration(const Token& token, Parameter* out, ProblemList* problems) {
  const auto blank = [](char c) { return c == ' ' || c == '\t'; };
  std::vector<std::string_view> words;
  for (size_t i = 0; i < token.text.size();) {
    while (i < token.text.size() && blank(token.text[i])) ++i;
    const size_t begin = i;
    while (i < token.text.size() && !blank(token.text[i])) ++i;
    if (i > begin) words.push_back(token.text.substr(begin, i - begin));
  }
  out->where = token.where.location();
  if (words.size() != 2) {
    problems->warning(out->where, "a parameter is declared as \"type name\", not " + in_quotes(token.text) +
                                      "; it is left out");
    return false;
  }
  for (const TypeName& t : kTypeNames) {
    if (t.name == words[0]) {
      out->type = t.type;
      out->name = words[1];
      return true;
    }
  }
  std::vector<std::string_view> names;
  for (const TypeName& t : kTypeNames) names.push_back(t.name);
  problems->warning(out->where, "unknown parameter type " + in_quotes(words[0]) +
                                    nearest_hint(words[0], names, "the parameter is left out"));
  return false;
}

/// Appends one value token; false (reported) if it does not fit the type.
bool add_value(const Token& token, Parameter* out, ProblemList* problems) {
  const auto fail = [&](const std::string& wanted) {
    problems->error(token.where.location(), "parameter " + in_quotes(out->name) + " (" +
                                                std::string(param_type_name(out->type)) + ") needs " +
                                                wanted + ", not " + shown(token));
    return false;
  };
  const bool is_string = token.kind == Token::Kind::kString;
  if (out->type == ParamType::kBool) {
    if (token.text != "true" && token.text != "false") return fail("true or false");
    out->numbers.push_back(token.text == "true" ? 1 : 0);
    return true;
  }
  if (takes_strings(out->type) || (out->type == ParamType::kSpectrum && is_string)) {
    if (!is_string) return fail("a quoted string");
    out->strings.emplace_back(token.text);
    return true;
  }
  double value = 0;
  const auto taken = [&](double other) {
    problems->warning(token.where.location(),
                      "parameter " + in_quotes(out->name) + " (" + std::string(param_type_name(out->type)) +
                          ") has the value " + shown(token) + ", which is taken as " + plain(other));
    value = other;
  };
  if (!parse_number(token.text, &value)) {
    const std::optional<double> odd = is_string ? std::nullopt : odd_number(token.text);
    if (!odd) return fail("finite numbers");
    taken(*odd);
  }
  if (out->type == ParamType::kInteger) {
    constexpr double kMost = std::numeric_limits<int32_t>::max();
    const double whole = std::clamp(std::round(value), -kMost, kMost);
    if (whole != value) taken(whole);
  } else if (constexpr double kMost = std::numeric_limits<float>::max(); std::abs(value) > kMost) {
    taken(std::copysign(kMost, value));
  }
  out->numbers.push_back(value);
  return true;
}

/// Reads the value or bracketed list after a declaration. False if something was wrong (and reported).
bool parse_values(PbrtTokenizer& tokens, Parameter* out, ProblemList* problems) {
  using Kind = Token::Kind;
  const Token first = tokens.peek();
  const auto missing = [&] {
    problems->error(out->where, "parameter " + in_quotes(out->name) + " has no value; found " + shown(first));
    return false;
  };
  if (first.kind == Kind::kEnd || first.kind == Kind::kClose) return missing();
  if (first.kind != Kind::kOpen) {
    double ignored = 0;
    const bool is_value = first.kind == Kind::kString || first.text == "true" || first.text == "false" ||
                          parse_number(first.text, &ignored) ||
                          !std::isalpha(static_cast<unsigned char>(first.text[0])) || first.text == "nan" ||
                          first.text == "inf";
    if (!is_value) return missing();  // the next directive: leave it
    return add_value(tokens.next(), out, problems);
  }
  tokens.next();
  bool ok = true;
  for (;;) {
    const Token& token = tokens.peek();
    if (token.kind == Kind::kClose) {
      tokens.next();
      break;
    }
    if (token.kind == Kind::kEnd || token.kind == Kind::kOpen) {
      problems->error(out->where, "the list of parameter " + in_quotes(out->name) +
                                      " is never closed: \"]\" expected at line " +
                                      std::to_string(token.where.line) + ", found " + shown(token));
      return false;
    }
    // After the first bad value the rest of the list is skipped in silence.
    const Token value = tokens.next();
    if (ok) ok = add_value(value, out, problems);
  }
  if (ok && out->numbers.empty() && out->strings.empty()) return missing();
  return ok;
}

}  // namespace

std::string_view param_type_name(ParamType type) {
  for (const TypeName& t : kTypeNames) {
    if (t.type == type) return t.name;
  }
  return "";
}

std::vector<Parameter> parse_parameters(PbrtTokenizer& tokens, ColorSpace color_space,
                                        ProblemList* problems) {
  std::vector<Parameter> list;
  while (tokens.peek().kind == Token::Kind::kString && !problems->full()) {
    Parameter parameter;
    parameter.color_space = color_space;
    const bool declared = parse_declaration(tokens.next(), &parameter, problems);
    if (!declared) {
      // Skip the value in silence, whatever it is.
      if (tokens.peek().kind == Token::Kind::kOpen) {
        while (tokens.peek().kind != Token::Kind::kClose && tokens.peek().kind != Token::Kind::kEnd)
          tokens.next();
        tokens.next();
      } else if (double ignored = 0;
                 tokens.peek().kind == Token::Kind::kString || parse_number(tokens.peek().text, &ignored)) {
        tokens.next();
      }
      continue;
    }
    parameter.malformed = !parse_values(tokens, &parameter, problems);
    const auto earlier =
        std::find_if(list.begin(), list.end(), [&](const Parameter& p) { return p.name == parameter.name; });
    if (earlier == list.end()) {
      list.push_back(std::move(parameter));
    } else {
      if (!parameter.malformed) {
        problems->warning(parameter.where, "parameter " + in_quotes(parameter.name) +
                                               " is given twice; the last one is taken, as by pbrt-v4");
      }
      *earlier = std::move(parameter);
    }
  }
  return list;
}

std::vector<Parameter> parse_untyped_parameter(PbrtTokenizer& tokens, ProblemList* problems) {
  Parameter p;
  const Token declaration = tokens.next();
  p.where = declaration.where.location();
  for (const char c : declaration.text) {
    if (c != '-' && c != '_') p.name += lower_case(c);
  }
  const Token& value = tokens.peek();
  double number = 0;
  if (value.kind == Token::Kind::kString) {
    p.type = ParamType::kString;
  } else if (value.text == "true" || value.text == "false") {
    p.type = ParamType::kBool;
  } else if (parse_number(value.text, &number) && number == std::trunc(number)) {
    p.type = ParamType::kInteger;
  }
  p.malformed = !parse_values(tokens, &p, problems);
  return {std::move(p)};
}

ParameterList::ParameterList(std::string owner, SourceLocation where, std::vector<Parameter> parameters,
                             ProblemList* problems)
    : owner_(std::move(owner)),
      where_(std::move(where)),
      parameters_(std::move(parameters)),
      problems_(problems) {}

Parameter* ParameterList::lookup(std::string_view name) {
  if (std::find(known_.begin(), known_.end(), name) == known_.end()) known_.push_back(name);
  for (Parameter& p : parameters_) {
    if (p.name == name) {
      p.used = true;
      return &p;
    }
  }
  return nullptr;
}

SourceLocation ParameterList::where_of(std::string_view name) const {
  for (const Parameter& p : parameters_) {
    if (p.name == name) return p.where;
  }
  return where_;
}

bool ParameterList::has(std::string_view name) const {
  return std::any_of(parameters_.begin(), parameters_.end(),
                     [&](const Parameter& p) { return p.name == name; });
}

void ParameterList::odd_value(std::string_view name, const std::string& message) {
  problems_->warning(where_of(name), "parameter " + in_quotes(name) + " of " + owner_ + " " + message);
}

void ParameterList::left_out(const std::string& why) {
  problems_->warning(where_, owner_ + " " + why + "; it is left out");
}

void ParameterList::bad_value(std::string_view name, const std::string& message) {
  problems_->error(where_of(name), "parameter " + in_quotes(name) + " of " + owner_ + " " + message);
}

const Parameter* ParameterList::find(std::string_view name, std::initializer_list<ParamType> types) {
  Parameter* p = lookup(name);
  if (p != nullptr && p->malformed) return nullptr;
  if (p == nullptr || std::find(types.begin(), types.end(), p->type) != types.end()) return p;
  std::string expected;
  for (ParamType type : types)
    expected += (expected.empty() ? "" : " or ") + in_quotes(param_type_name(type));
  const std::string type = "has type " + in_quotes(param_type_name(p->type)) + "; it must be " + expected;
  const bool can_be = coerce(types, p);
  odd_value(name, type + (can_be ? ", as which it is taken" : "; it is left out"));
  p->malformed = !can_be;
  return can_be ? p : nullptr;
}

const std::vector<double>* ParameterList::numbers(std::string_view name, ParamType type) {
  const Parameter* p = find(name, {type});
  if (p == nullptr) return nullptr;
  if (const size_t extra = p->numbers.size() % components(type); extra != 0) {
    odd_value(name, "has " + std::to_string(p->numbers.size()) + " numbers; it needs a multiple of " +
                        std::to_string(components(type)) + "; the last are left out");
    std::vector<double>& numbers = lookup(name)->numbers;
    numbers.resize(numbers.size() - extra);
  }
  return &p->numbers;
}

const std::vector<double>* ParameterList::numbers(std::string_view name, ParamType type, size_t count) {
  const Parameter* found = find(name, {type});
  if (found == nullptr) return nullptr;
  if (found->numbers.size() == count) return &found->numbers;
  const bool enough = found->numbers.size() > count;
  odd_value(name, "has " + std::to_string(found->numbers.size()) + " numbers; it needs " +
                      std::to_string(count) + (enough ? "; the first are taken" : "; it is left out"));
  Parameter* const p = lookup(name);
  p->numbers.resize(enough ? count : 0);
  p->malformed = !enough;
  return enough ? &p->numbers : nullptr;
}

double ParameterList::number(std::string_view name, double fallback, double min, double max) {
  const std::vector<double>* values = numbers(name, ParamType::kFloat, 1);
  if (values == nullptr) return fallback;
  const double value = values->front();
  if (value >= min && value <= max) return value;
  odd_value(name,
            (value < min ? (min > 0 && min < 1e-30 ? "must be above 0" : "must be at least " + plain(min))
                         : "must be at most " + plain(max)) +
                ", not " + plain(value) + "; that is taken");
  return std::clamp(value, min, max);
}

int64_t ParameterList::integer(std::string_view name, int64_t fallback, int64_t min, int64_t max) {
  const std::vector<double>* values = numbers(name, ParamType::kInteger, 1);
  if (values == nullptr) return fallback;
  const auto value = static_cast<int64_t>(values->front());
  if (value >= min && value <= max) return value;
  odd_value(name, (value < min ? "must be at least " + std::to_string(min)
                               : "must be at most " + std::to_string(max)) +
                      ", not " + std::to_string(value) + "; that is taken");
  return std::clamp(value, min, max);
}

bool ParameterList::boolean(std::string_view name, bool fallback) {
  const std::vector<double>* values = numbers(name, ParamType::kBool, 1);
  return values == nullptr ? fallback : values->front() != 0;
}

std::string ParameterList::text(std::string_view name, const std::string& fallback) {
  const Parameter* p = find(name, {ParamType::kString});
  if (p == nullptr) return fallback;
  if (p->strings.size() != 1)
    odd_value(name, "needs one string, not " + std::to_string(p->strings.size()) + "; the first is taken");
  return p->strings.front();
}

void ParameterList::accept(std::initializer_list<std::string_view> names) {
  for (std::string_view name : names) lookup(name);
}

void ParameterList::unsupported(std::string_view name, const std::string& consequence) {
  if (lookup(name) != nullptr) {
    problems_->unsupported(where_of(name),
                           "parameter " + in_quotes(name) + " of " + owner_ + " " + consequence);
  }
}

void ParameterList::finish() {
  for (const Parameter& p : parameters_) {
    if (p.used || p.inherited) continue;
    problems_->warning(p.where, "unknown parameter " + in_quotes(p.name) + " of " + owner_ +
                                    nearest_hint(p.name, known_, "it is left out"));
  }
}

}  // namespace lightmill
