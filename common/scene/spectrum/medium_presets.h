#pragma once
// Measured media by the names that scene files use for them.
#include <string_view>
#include <vector>

#include "common/scene/description.h"

namespace lightmill {

/// Coefficients per mm in linear RGB. The scattering coefficient is the reduced one, sigma_s (1 - g): with an
/// isotropic phase function it spreads light as the medium does.
struct MeasuredMedium {
  std::string_view name;
  Rgb reduced_sigma_s, sigma_a;
};

/// Null if there is none of that name.
const MeasuredMedium* find_measured_medium(std::string_view name);
std::vector<std::string_view> measured_medium_names();

}  // namespace lightmill
