#pragma once
// Typed parameter lists of pbrt directives: `"float radius" 2 "rgb L" [1 1 1]`.
//
// A translator asks for every parameter that it knows; `finish` then warns of what nobody asked for, with the
// nearest known name, at the parameter's own declaration.
//
// What real programs write is read: a value out of its range is clamped, a type that can stand for the right
// one is taken for it (common/scene/pbrt/syntax/coerce.h), and what means nothing is left out, each with a
// warning.
#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/pbrt/syntax/tokenizer.h"
#include "common/scene/spectrum/color_space.h"

namespace lightmill {

/// A bound for parameters of any size: all of them are in float's range.
inline constexpr double kAnySize = 3e38;

enum class ParamType {
  kInteger,
  kFloat,
  kPoint2,
  kVector2,
  kPoint3,
  kVector3,
  kNormal,
  kBool,
  kString,
  kRgb,
  kXyz,
  kSpectrum,
  kBlackbody,
  kTexture,
};
/// The type's name in a scene file ("point3").
std::string_view param_type_name(ParamType type);

/// A number as messages show it: "0.5", without a tail of zeros.
std::string plain_number(double x);
/// Whether `word` is among `words`.
inline bool is_one_of(std::string_view word, const std::vector<std::string_view>& words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

struct Parameter {
  ParamType type = ParamType::kFloat;
  std::string name;
  SourceLocation where;              // of the declaration string
  std::vector<double> numbers;       // also bools, as 0 and 1
  std::vector<std::string> strings;  // string, texture, named spectrum
  bool inherited = false;            // from an Attribute directive: may stay unused
  bool used = false;
  bool malformed = false;                      // its value was reported and is missing here
  ColorSpace color_space = ColorSpace::kSrgb;  // of rgb values
};

/// Reads the parameters that follow a directive, up to the next token that is not a string. What is
/// malformed is reported; a parameter whose name is known at least stays in the list, marked.
std::vector<Parameter> parse_parameters(PbrtTokenizer& tokens, ColorSpace color_space, ProblemList* problems);

/// Reads `"name" value`, the type being the value's own; case, "-" and "_" do not count in the name.
std::vector<Parameter> parse_untyped_parameter(PbrtTokenizer& tokens, ProblemList* problems);

class ParameterList {
 public:
  /// `owner` names the directive in messages, e.g. `shape "sphere"`.
  ParameterList(std::string owner, SourceLocation where, std::vector<Parameter> parameters,
                ProblemList* problems);

  const std::string& owner() const { return owner_; }
  const SourceLocation& where() const { return where_; }
  ProblemList& problems() { return *problems_; }
  /// Where `name` is declared, or the directive.
  SourceLocation where_of(std::string_view name) const;
  bool has(std::string_view name) const;

  /// One value, clamped (with a warning) to [min, max]; `fallback` if absent, or (reported) of another type
  /// or count.
  double number(std::string_view name, double fallback, double min, double max);
  int64_t integer(std::string_view name, int64_t fallback, int64_t min, int64_t max);
  bool boolean(std::string_view name, bool fallback);
  std::string text(std::string_view name, const std::string& fallback);

  /// All numbers of the parameter of this name and type, or nullptr if absent. Reports a type that differs
  /// and a count that is not a multiple of the type's components.
  const std::vector<double>* numbers(std::string_view name, ParamType type);
  /// The same with exactly `count` numbers.
  const std::vector<double>* numbers(std::string_view name, ParamType type, size_t count);
  /// The parameter of this name if its type is among `types` or can be made one of them. Null also if its
  /// value was malformed, or of a type that means nothing here (reported): then `has` is true all the same.
  const Parameter* find(std::string_view name, std::initializer_list<ParamType> types);

  /// Takes the parameters of these names out of the list.
  std::vector<Parameter> take(const std::vector<std::string_view>& names);
  /// Declares parameters that are legal and change nothing here (such as a BVH's split method).
  void accept(std::initializer_list<std::string_view> names);
  /// Declares a legal parameter that is not supported yet: warns with `consequence` if it is given.
  void unsupported(std::string_view name, const std::string& consequence);
  /// An error about a value of `name` that leaves nothing to render: `parameter "name" ` + `message`.
  void bad_value(std::string_view name, const std::string& message);
  /// A warning about one that is rendered otherwise; the message says how.
  void odd_value(std::string_view name, const std::string& message);

  /// Warns that what the directive makes is left out: its owner, then `why`.
  void left_out(const std::string& why);

  /// Warns of the parameters that nobody asked for.
  void finish();

 private:
  Parameter* lookup(std::string_view name);

  std::string owner_;
  SourceLocation where_;
  std::vector<Parameter> parameters_;
  std::vector<std::string_view> known_;  // every name asked for; literals
  ProblemList* problems_;
};

}  // namespace lightmill
