#include "common/scene/pbrt/syntax/params.h"

#include <algorithm>
#include <cmath>

#include "common/scene/pbrt/syntax/coerce.h"

namespace lightmill {
namespace {

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

}  // namespace

std::string plain_number(double x) {
  std::string s = std::to_string(x);
  if (s.find('.') != std::string::npos) {
    s.erase(s.find_last_not_of('0') + 1);
    if (s.back() == '.') s.pop_back();
  }
  return s;
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
  odd_value(name, (value < min ? (min > 0 && min < 1e-30 ? "must be above 0"
                                                         : "must be at least " + plain_number(min))
                               : "must be at most " + plain_number(max)) +
                      ", not " + plain_number(value) + "; that is taken");
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

std::vector<Parameter> ParameterList::take(const std::vector<std::string_view>& names) {
  std::vector<Parameter> taken;
  for (const Parameter& p : parameters_) {
    if (is_one_of(p.name, names)) taken.push_back(p);
  }
  std::erase_if(parameters_, [&](const Parameter& p) { return is_one_of(p.name, names); });
  return taken;
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
