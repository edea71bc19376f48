#pragma once
// The figures of BoxErrors and their names in JSON, CSV and the metadata of images.
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/error/error_curve.h"

namespace lightmill {

struct BoxFigure {
  std::string name;  // "relmse_16_low"
  size_t box = 0;    // index in kBoxSides
  std::optional<double> BoxError::*member = nullptr;

  const std::optional<double>& of(const BoxErrors& boxes) const { return boxes[box].*member; }
  std::optional<double>& of(BoxErrors& boxes) const { return boxes[box].*member; }
};

/// "relmse_4", "relmse_4_low", "relmse_4_high", the same of the other sides, then "true_relmse_4" and so on.
inline const std::vector<BoxFigure>& box_figures() {
  static const std::vector<BoxFigure> figures = [] {
    std::vector<BoxFigure> all;
    const auto add = [&](const char* before, size_t box, const char* after,
                         std::optional<double> BoxError::*member) {
      all.push_back({before + std::to_string(kBoxSides[box]) + after, box, member});
    };
    for (size_t i = 0; i < kBoxSides.size(); ++i) {
      add("relmse_", i, "", &BoxError::relmse);
      add("relmse_", i, "_low", &BoxError::relmse_low);
      add("relmse_", i, "_high", &BoxError::relmse_high);
    }
    for (size_t i = 0; i < kBoxSides.size(); ++i) add("true_relmse_", i, "", &BoxError::true_relmse);
    return all;
  }();
  return figures;
}

/// Those of them that need no reference.
inline std::span<const BoxFigure> box_estimates() {
  return std::span(box_figures()).first(3 * kBoxSides.size());
}

}  // namespace lightmill
