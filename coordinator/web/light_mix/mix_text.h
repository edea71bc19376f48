#pragma once
// A light mix as the dashboard's requests have it: "key:1.5,fill:0.2/0.3/0.4".
#include <string_view>
#include <vector>

#include "common/image/light_groups/light_factor.h"
#include "common/job/light_groups.h"

namespace lightmill {

/// Longer ones are refused. All groups with long names fit in.
inline constexpr size_t kMaxMixText = 4096;

/// A factor for each of `groups`, in their order: 1 where none is given. "NAME:FACTOR" multiplies all of a
/// group's light, "NAME:R/G/B" each channel; commas are between groups. The empty text is no change. Throws
/// Error(kUsage) for what is not of this form, a factor that light_factor_of_text refuses, a group that is
/// not there, and one that comes twice.
std::vector<LightFactor> light_factors_of_text(std::string_view text, const LightGroups& groups);

}  // namespace lightmill
