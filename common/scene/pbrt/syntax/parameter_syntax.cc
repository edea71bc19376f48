// The text of parameter lists.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

#include "common/base/lower_case.h"
#include "common/base/parse_number.h"
#include "common/scene/pbrt/syntax/params.h"

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
                          ") has the value " + shown(token) + ", which is taken as " + plain_number(other));
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
  if (ok && out->numbers.empty() && out->strings.empty()) {
    problems->warning(out->where, "parameter " + in_quotes(out->name) + " has no value; it is left out");
    return false;
  }
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

}  // namespace lightmill
