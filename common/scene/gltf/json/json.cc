#include "common/scene/gltf/json/json.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/scene/problem_list.h"

namespace lightmill {
namespace {

using nlohmann::json;

std::string range_text(double low, double high) {
  const auto shown = [](double x) {
    std::string text = json(x).dump();
    return text.ends_with(".0") ? text.substr(0, text.size() - 2) : text;
  };
  return "from " + shown(low) + " to " + shown(high);
}

}  // namespace

std::string json_pointer_token(const std::string& key) {
  std::string out;
  for (const char c : key) out += c == '~' ? "~0" : c == '/' ? "~1" : std::string(1, c);
  return out;
}

void GltfValue::fail(const std::string& message) const { throw GltfProblem{pointer_, message}; }

GltfValue GltfValue::nothing() const {
  static const json kEmpty = json::object();
  return {kEmpty, pointer_, mended_};
}

std::optional<GltfValue> GltfValue::find(const char* key) const {
  if (!json_->is_object()) fail("must be an object");
  const auto found = json_->find(key);
  if (found == json_->end()) return std::nullopt;
  GltfValue value(*found, pointer_ + "/" + json_pointer_token(key), mended_);
  if (!found->is_null()) return value;
  value.mended("is null; it is left out");
  return std::nullopt;
}

GltfValue GltfValue::require(const char* key) const {
  auto value = find(key);
  if (!value) fail(std::string("needs \"") + key + "\"");
  return *value;
}

std::optional<GltfValue> GltfValue::find_object(const char* key) const {
  auto value = find(key);
  if (!value || value->is_object()) return value;
  value->mended("should be an object; it is left out");
  return std::nullopt;
}

std::optional<GltfValue> GltfValue::extension(const char* name) const {
  const auto extensions = find_object("extensions");
  return extensions ? extensions->find_object(name) : std::nullopt;
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
  return {(*json_)[i], pointer_ + "/" + std::to_string(i), mended_};
}

size_t GltfValue::count(const char* key) const {
  const auto list = find(key);
  if (!list) return 0;
  if (list->json_->is_array()) return list->size();
  list->mended("should be an array; it is left out");
  return 0;
}

bool GltfValue::is_object() const { return json_->is_object(); }

bool GltfValue::is_number() const { return json_->is_number(); }

bool GltfValue::is_string() const { return json_->is_string(); }

double GltfValue::number(double low, double high) const {
  if (!json_->is_number()) fail("must be a number");
  const auto x = json_->get<double>();
  if (x >= low && x <= high) return x;
  mended(json_->dump() + " is not " + range_text(low, high) + "; it is clamped");
  return std::clamp(x, low, high);
}

int64_t GltfValue::integer(int64_t low, int64_t high) const {
  if (!json_->is_number()) fail("must be a number");
  const auto x = json_->get<double>();
  const auto least = static_cast<double>(low), most = static_cast<double>(high);
  if (!(x >= least && x <= most)) fail("must be a number " + range_text(least, most));
  if (x != std::floor(x)) fail("must be a whole number");
  return static_cast<int64_t>(x);
}

std::string GltfValue::text() const {
  if (!json_->is_string()) fail("must be a string");
  return json_->get<std::string>();
}

double GltfValue::number_or(const char* key, double fallback, double low, double high) const {
  const auto value = find(key);
  if (!value) return fallback;
  if (value->json_->is_number()) return value->number(low, high);
  value->mended("should be a number; it is left out");
  return fallback;
}

int64_t GltfValue::integer_or(const char* key, int64_t fallback, int64_t low, int64_t high) const {
  const auto value = find(key);
  if (!value) return fallback;
  if (value->json_->is_number()) return value->integer(low, high);
  value->mended("should be a number; it is left out");
  return fallback;
}

std::string GltfValue::text_or(const char* key, const std::string& fallback) const {
  const auto value = find(key);
  if (!value) return fallback;
  if (value->json_->is_string()) return value->text();
  value->mended("should be a string; it is left out");
  return fallback;
}

std::string GltfValue::text_or_number(const char* key) const {
  const GltfValue value = require(key);
  return value.json_->is_number() ? value.json_->dump() : value.text();
}

bool GltfValue::boolean_or(const char* key, bool fallback) const {
  const auto value = find(key);
  if (!value) return fallback;
  if (value->json_->is_boolean()) return value->json_->get<bool>();
  value->mended("should be true or false; it is left out");
  return fallback;
}

std::vector<double> GltfValue::numbers_or(const char* key, std::vector<double> fallback, double low,
                                          double high) const {
  const auto value = find(key);
  if (!value) return fallback;
  const size_t there = value->json_->is_array() ? value->size() : 0;
  if (there != fallback.size())
    value->mended("should hold " + std::to_string(fallback.size()) + " numbers; what is there counts");
  for (size_t i = 0; i < std::min(there, fallback.size()); ++i) {
    const GltfValue x = (*value)[i];
    if (x.json_->is_number()) {
      fallback[i] = x.number(low, high);
    } else {
      x.mended("should be a number; it is left out");
    }
  }
  return fallback;
}

Rgb GltfValue::color_or(const char* key, const Rgb& fallback, double high) const {
  const auto c = numbers_or(key, {fallback.r, fallback.g, fallback.b}, 0, high);
  return {static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])};
}

int GltfValue::index_or_none(const char* key, size_t count, const char* what) const {
  const auto value = find(key);
  if (!value) return -1;
  if (!value->json_->is_number()) {
    value->mended("should be a number; it is left out");
    return -1;
  }
  const int64_t i = value->integer(-1, (int64_t{1} << 31) - 1);
  if (i < 0) {
    value->mended("is -1; it is left out");
    return -1;
  }
  if (static_cast<size_t>(i) >= count) {
    value->fail("refers to " + std::string(what) + " " + std::to_string(i) + ", but there are " +
                std::to_string(count));
  }
  return static_cast<int>(i);
}

}  // namespace lightmill
