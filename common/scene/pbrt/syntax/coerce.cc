#include "common/scene/pbrt/syntax/coerce.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "common/base/parse_number.h"

namespace lightmill {
namespace {

bool is_vector(ParamType type) {
  return type == ParamType::kPoint3 || type == ParamType::kVector3 || type == ParamType::kNormal;
}
bool is_pair(ParamType type) { return type == ParamType::kPoint2 || type == ParamType::kVector2; }
bool is_number(ParamType type) { return type == ParamType::kFloat || type == ParamType::kInteger; }
bool is_word(ParamType type) { return type == ParamType::kString || type == ParamType::kTexture; }

/// Numbers that stand in strings, all of them.
bool read_numbers(Parameter* p) {
  std::vector<double> numbers;
  for (const std::string& text : p->strings) {
    double x = 0;
    if (!parse_number(text, &x) || std::abs(x) > std::numeric_limits<float>::max()) return false;
    numbers.push_back(x);
  }
  if (numbers.empty()) return false;
  p->numbers = std::move(numbers);
  p->strings.clear();
  return true;
}

bool to_bool(Parameter* p) {
  if (is_number(p->type) && p->numbers.size() == 1) {
    p->numbers[0] = p->numbers[0] != 0;
    return true;
  }
  if (p->type != ParamType::kString || p->strings.size() != 1) return false;
  constexpr std::array<const char*, 4> kYes = {"true", "on", "yes", "1"}, kNo = {"false", "off", "no", "0"};
  const auto is = [&](const char* word) { return p->strings[0] == word; };
  if (!std::ranges::any_of(kYes, is) && !std::ranges::any_of(kNo, is)) return false;
  p->numbers = {std::ranges::any_of(kYes, is) ? 1.0 : 0.0};
  p->strings.clear();
  return true;
}

bool to_float(Parameter* p) {
  if (p->type == ParamType::kString) return read_numbers(p);
  if (p->type == ParamType::kRgb && p->numbers.size() == 3) {
    p->numbers = {(p->numbers[0] + p->numbers[1] + p->numbers[2]) / 3};
    return true;
  }
  if (p->type == ParamType::kSpectrum && p->strings.empty() && p->numbers.size() >= 2 &&
      p->numbers.size() % 2 == 0) {  // pairs of wavelength and value
    double sum = 0;
    for (size_t i = 1; i < p->numbers.size(); i += 2) sum += p->numbers[i];
    p->numbers = {sum / (static_cast<double>(p->numbers.size()) / 2)};
    return true;
  }
  return p->type != ParamType::kSpectrum && p->type != ParamType::kXyz && p->type != ParamType::kBlackbody &&
         !is_word(p->type);
}

bool to_integer(Parameter* p) {
  if (!(p->type == ParamType::kFloat || p->type == ParamType::kBool) &&
      !(p->type == ParamType::kString && read_numbers(p)))
    return false;
  constexpr double kMost = std::numeric_limits<int32_t>::max();
  for (double& x : p->numbers) x = std::clamp(std::round(x), -kMost, kMost);
  return true;
}

bool to_rgb(Parameter* p) {
  if (!(is_number(p->type) || is_vector(p->type))) return false;
  if (p->numbers.size() == 1) p->numbers.resize(3, p->numbers[0]);
  return p->numbers.size() == 3;
}

bool can_be(ParamType type, Parameter* p) {
  switch (type) {
    case ParamType::kBool:
      return to_bool(p);
    case ParamType::kFloat:
      return to_float(p);
    case ParamType::kInteger:
      return to_integer(p);
    case ParamType::kRgb:
      return to_rgb(p);
    case ParamType::kPoint2:
    case ParamType::kVector2:
      return is_pair(p->type) || is_number(p->type);
    case ParamType::kPoint3:
    case ParamType::kVector3:
    case ParamType::kNormal:
      return is_vector(p->type) || is_number(p->type) || p->type == ParamType::kRgb;
    case ParamType::kString:
    case ParamType::kTexture:
      return is_word(p->type);
    default:
      return false;
  }
}

}  // namespace

bool coerce(std::initializer_list<ParamType> types, Parameter* parameter) {
  for (const ParamType type : types) {
    if (!can_be(type, parameter)) continue;
    parameter->type = type;
    return true;
  }
  return false;
}

}  // namespace lightmill
