#pragma once
// Checked access to the JSON of a glTF file. Every value knows its JSON pointer, so that whatever is wrong
// with it can be said with the place.
//
//   const GltfValue node = root.require("nodes")[3];
//   const double width = node.number_or("width", 1, 0, 10);   // throws GltfProblem at /nodes/3/width
#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/scene/description.h"

namespace lightmill {

/// Thrown for input that can't be used; whoever reads a part of the scene reports it and goes on.
struct GltfProblem {
  std::string pointer, message;
};

class GltfValue {
 public:
  GltfValue(const nlohmann::json& json, std::string pointer) : json_(&json), pointer_(std::move(pointer)) {}

  const std::string& pointer() const { return pointer_; }
  [[noreturn]] void fail(const std::string& message) const;

  /// A member of this object, or nothing.
  std::optional<GltfValue> find(const char* key) const;
  GltfValue require(const char* key) const;
  std::optional<GltfValue> extension(const char* name) const;
  /// Names of this object's members.
  std::vector<std::string> keys() const;
  /// Elements of this array.
  size_t size() const;
  GltfValue operator[](size_t i) const;
  /// Elements of a member that is an array; 0 if it is absent.
  size_t count(const char* key) const;

  double number(double low, double high) const;
  int64_t integer(int64_t low, int64_t high) const;
  std::string text() const;

  // Members with defaults.
  double number_or(const char* key, double fallback, double low, double high) const;
  int64_t integer_or(const char* key, int64_t fallback, int64_t low, int64_t high) const;
  std::string text_or(const char* key, const std::string& fallback) const;
  bool boolean_or(const char* key, bool fallback) const;
  std::vector<double> numbers_or(const char* key, std::vector<double> fallback, double low,
                                 double high) const;
  Rgb color_or(const char* key, const Rgb& fallback, double high) const;
  /// An index into an array of `count` elements called `what`; -1 if the member is absent.
  int index_or_none(const char* key, size_t count, const char* what) const;

 private:
  const nlohmann::json* json_;
  std::string pointer_;
};

/// Parses JSON text: bounded in depth and number of values. Throws GltfProblem; the message of a syntax error
/// comes with `*where` (line and column).
nlohmann::json parse_gltf_json(const std::string& text, SourceLocation* where);
/// Line and column of the value at `pointer` in valid JSON `text`, or of the last of its ancestors that
/// exists.
SourceLocation locate_in_json(const std::string& text, const std::string& pointer, const std::string& file);

}  // namespace lightmill
