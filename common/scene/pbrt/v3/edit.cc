#include "common/scene/pbrt/v3/edit.h"

#include <algorithm>
#include <utility>

namespace lightmill::v3 {

Parameter* Edit::find(std::string_view name) {
  const auto found = std::ranges::find_if(parameters_, [&](const Parameter& p) { return p.name == name; });
  return found == parameters_.end() ? nullptr : &*found;
}

void Edit::rename(std::string_view from, std::string_view to) {
  Parameter* const p = find(from);
  if (p != nullptr && !has(to)) p->name = to;
}

void Edit::remove(std::initializer_list<std::string_view> names) {
  std::erase_if(parameters_, [&](const Parameter& p) {
    return std::ranges::find(names, std::string_view(p.name)) != names.end();
  });
}

double Edit::number(std::string_view name, double fallback) {
  const Parameter* const p = find(name);
  return p != nullptr && p->numbers.size() == 1 ? p->numbers[0] : fallback;
}

std::string Edit::text(std::string_view name, const std::string& fallback) {
  const Parameter* const p = find(name);
  return p != nullptr && p->strings.size() == 1 ? p->strings[0] : fallback;
}

Parameter& Edit::slot(std::string_view name, ParamType type) {
  Parameter* p = find(name);
  if (p == nullptr) {
    p = &parameters_.emplace_back();
    p->where = where_;
  }
  p->type = type;
  p->name = name;
  p->numbers.clear();
  p->strings.clear();
  p->malformed = false;
  return *p;
}

void Edit::set(std::string_view name, ParamType type, std::vector<double> numbers) {
  slot(name, type).numbers = std::move(numbers);
}

void Edit::set_words(std::string_view name, ParamType type, std::vector<std::string> words) {
  slot(name, type).strings = std::move(words);
}

void Edit::set_default(std::string_view name, ParamType type, std::vector<double> numbers) {
  if (!has(name)) set(name, type, std::move(numbers));
}

std::optional<double> grey_value(const Parameter& p) {
  const std::vector<double>& n = p.numbers;
  if (p.type == ParamType::kFloat && n.size() == 1) return n[0];
  if (p.type == ParamType::kRgb && n.size() == 3 && n[0] == n[1] && n[1] == n[2]) return n[0];
  return std::nullopt;
}

}  // namespace lightmill::v3
