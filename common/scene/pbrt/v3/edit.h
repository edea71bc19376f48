#pragma once
// Changes to the parameters of a directive before they are read.
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/pbrt/syntax/params.h"

namespace lightmill::v3 {

class Edit {
 public:
  Edit(const SourceLocation& where, std::vector<Parameter>* parameters)
      : where_(where), parameters_(*parameters) {}

  /// Null if absent.
  Parameter* find(std::string_view name);
  bool has(std::string_view name) { return find(name) != nullptr; }
  /// If there is one, and none of the other name.
  void rename(std::string_view from, std::string_view to);
  void remove(std::initializer_list<std::string_view> names);
  /// The number of a parameter that has just one; `fallback` otherwise.
  double number(std::string_view name, double fallback);
  std::string text(std::string_view name, const std::string& fallback);
  /// Replaces or adds.
  void set(std::string_view name, ParamType type, std::vector<double> numbers);
  void set_words(std::string_view name, ParamType type, std::vector<std::string> words);
  /// Adds unless it is there.
  void set_default(std::string_view name, ParamType type, std::vector<double> numbers);

 private:
  Parameter& slot(std::string_view name, ParamType type);
  const SourceLocation where_;
  std::vector<Parameter>& parameters_;
};

/// The one number of an rgb whose three are alike, or of a float; nothing for a texture and all else.
std::optional<double> grey_value(const Parameter& parameter);

}  // namespace lightmill::v3
