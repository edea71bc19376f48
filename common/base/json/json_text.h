#pragma once
// A JSON object written field by field, as text at once: what leases and commits write thousands of times a
// second. A tree of nlohmann's would take ten times as long.
//
//   JsonText text;
//   text.add("spp", 16).add("name", "a").add_raw("crop", "[0,0,8,8]");
//   text.end()      // {"spp":16,"name":"a","crop":[0,0,8,8]}
#include <concepts>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

namespace lightmill {

class JsonText {
 public:
  /// Keys, here and below, need no escapes.
  JsonText& add(const char* key, const std::string& text) {
    // A text that is not UTF-8 must not make the object unwritable.
    return add_raw(key, nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  }
  JsonText& add(const char* key, const char* text) { return add(key, std::string(text)); }
  template <std::same_as<bool> Bool>
  JsonText& add(const char* key, Bool value) {
    return add_raw(key, value ? "true" : "false");
  }
  template <std::integral Int>
  requires(!std::same_as<Int, bool>) JsonText& add(const char* key, Int value) {
    return add_raw(key, std::to_string(value));
  }
  /// Reads back the same.
  JsonText& add(const char* key, double value) { return add_raw(key, nlohmann::json(value).dump()); }
  /// `json` is JSON already.
  JsonText& add_raw(const char* key, const std::string& json) {
    text_.append(text_.size() > 1 ? ",\"" : "\"").append(key).append("\":").append(json);
    return *this;
  }
  /// The object; call once, in the end.
  std::string end() { return std::move(text_.append(1, '}')); }

 private:
  std::string text_ = "{";
};

}  // namespace lightmill
