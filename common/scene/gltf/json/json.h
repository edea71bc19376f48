#pragma once
// Checked access to the JSON of a glTF file. Every value knows its JSON pointer, so that whatever is wrong
// with it can be said with the place.
//
// A value a little wrong is mended, and whoever reads the file is told: a number out of its range is clamped,
// a member of another type than it should have is left out. An index is never mended.
//
//   const GltfValue node = root.require("nodes")[3];
//   const double width = node.number_or("width", 1, 0, 10);   // of 11: 10, and mended("/nodes/3/width", ...)
#include <array>
#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/scene/problem_list.h"

namespace lightmill {

/// Thrown for input that can't be used; whoever reads a part of the scene reports it and goes on.
struct GltfProblem {
  std::string pointer, message;
};

/// Told of what was mended: where, and what was done.
using GltfMended = std::function<void(const std::string& pointer, const std::string& message)>;

class GltfValue {
 public:
  /// `mended` outlives the value and all that is read of it; null: nobody is told.
  GltfValue(const nlohmann::json& json, std::string pointer, const GltfMended* mended)
      : json_(&json), pointer_(std::move(pointer)), mended_(mended) {}

  const std::string& pointer() const { return pointer_; }
  [[noreturn]] void fail(const std::string& message) const;
  void mended(const std::string& message) const {
    if (mended_) (*mended_)(pointer_, message);
  }
  /// The same value, of which nobody is told what is mended.
  GltfValue silent() const { return {*json_, pointer_, nullptr}; }
  /// An object without members in this one's place, for what is absent.
  GltfValue nothing() const;

  /// A member of this object, or nothing; a null is nothing, too.
  std::optional<GltfValue> find(const char* key) const;
  GltfValue require(const char* key) const;
  /// A member that is an object, or nothing.
  std::optional<GltfValue> find_object(const char* key) const;
  std::optional<GltfValue> extension(const char* name) const;
  /// Names of this object's members.
  std::vector<std::string> keys() const;
  /// Elements of this array.
  size_t size() const;
  GltfValue operator[](size_t i) const;
  /// Elements of a member that is an array; 0 if it is absent or (mended) something else.
  size_t count(const char* key) const;
  bool is_object() const;
  bool is_number() const;
  bool is_string() const;

  /// Clamped. Throws if it is no number.
  double number(double low, double high) const;
  /// Throws if it is no whole number within the range.
  int64_t integer(int64_t low, int64_t high) const;
  std::string text() const;

  // Members with defaults, which also stand in for what has another type. Numbers are clamped, but for
  // integers, which throw. A list may be too short or too long: then the default fills it, or the rest is
  // left.
  double number_or(const char* key, double fallback, double low, double high) const;
  int64_t integer_or(const char* key, int64_t fallback, int64_t low, int64_t high) const;
  std::string text_or(const char* key, const std::string& fallback) const;
  /// Of a member that must be there; a number as it is written.
  std::string text_or_number(const char* key) const;
  bool boolean_or(const char* key, bool fallback) const;
  std::vector<double> numbers_or(const char* key, std::vector<double> fallback, double low,
                                 double high) const;
  Rgb color_or(const char* key, const Rgb& fallback, double high) const;
  /// An index into an array of `count` elements called `what`; -1 if the member is absent, -1 or no number.
  int index_or_none(const char* key, size_t count, const char* what) const;

 private:
  const nlohmann::json* json_;
  std::string pointer_;
  const GltfMended* mended_;
};

/// A key within a JSON pointer: "~" and "/" are escaped (RFC 6901).
std::string json_pointer_token(const std::string& key);
/// Parses JSON text: bounded in depth and number of values. Throws GltfProblem; the message of a syntax error
/// comes with `*where` (line and column). NaN, Infinity and numbers beyond double become finite, with a
/// warning.
nlohmann::json parse_gltf_json(const std::string& text, SourceLocation* where, ProblemList* problems);
/// Line and column of the value at `pointer` in valid JSON `text`, or of the last of its ancestors that
/// exists.
SourceLocation locate_in_json(const std::string& text, const std::string& pointer, const std::string& file);

}  // namespace lightmill
