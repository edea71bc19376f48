#pragma once
// The values of a request's body, each asked for by name.
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>

#include "common/base/error.h"

namespace lightmill {

/// Priorities are from minus this to this.
inline constexpr int64_t kMaxPriority = std::numeric_limits<int32_t>::max();

/// A JSON object; a name that nobody asks for is an error. All throw Error(kUsage).
class Fields {
 public:
  explicit Fields(const std::string& body)
      : object_(nlohmann::json::parse(body.empty() ? "{}" : body, nullptr, false)) {
    if (!object_.is_object()) throw Error(ErrorKind::kUsage, "the body must be a JSON object");
  }
  explicit Fields(nlohmann::json object) : object_(std::move(object)) {
    if (!object_.is_object()) throw Error(ErrorKind::kUsage, "a JSON object is expected");
  }
  std::optional<int64_t> integer(const char* name, int64_t least, int64_t most) {
    const nlohmann::json* value = find(name);
    if (!value) return std::nullopt;
    if (!value->is_number_integer() || (value->is_number_unsigned() && value->get<uint64_t>() > INT64_MAX) ||
        value->get<int64_t>() < least || value->get<int64_t>() > most) {
      throw Error(ErrorKind::kUsage, std::string(name) + " must be a whole number from " +
                                         std::to_string(least) + " to " + std::to_string(most));
    }
    return value->get<int64_t>();
  }
  std::optional<double> number(const char* name) {
    const nlohmann::json* value = find(name);
    if (!value) return std::nullopt;
    if (!value->is_number() || !(value->get<double>() >= 0))
      throw Error(ErrorKind::kUsage, std::string(name) + " must be a number from 0");
    return value->get<double>();
  }
  std::optional<std::string> text(const char* name) {
    const nlohmann::json* value = find(name);
    if (!value) return std::nullopt;
    if (!value->is_string()) throw Error(ErrorKind::kUsage, std::string(name) + " must be a text");
    return value->get<std::string>();
  }
  std::optional<bool> flag(const char* name) {
    const nlohmann::json* value = find(name);
    if (!value) return std::nullopt;
    if (!value->is_boolean()) throw Error(ErrorKind::kUsage, std::string(name) + " must be true or false");
    return value->get<bool>();
  }
  /// Empty if it is absent.
  nlohmann::json array(const char* name) {
    const nlohmann::json* value = find(name);
    if (!value) return nlohmann::json::array();
    if (!value->is_array()) throw Error(ErrorKind::kUsage, std::string(name) + " must be an array");
    return *value;
  }
  void end() const {
    for (const auto& [name, value] : object_.items()) {
      if (!known_.contains(name))
        throw Error(ErrorKind::kUsage, "\"" + name.substr(0, 100) + "\" is not known here");
    }
  }

 private:
  const nlohmann::json* find(const char* name) {
    known_.insert(name);
    const auto found = object_.find(name);
    return found == object_.end() || found->is_null() ? nullptr : &*found;
  }
  const nlohmann::json object_;
  std::set<std::string> known_;
};

}  // namespace lightmill
