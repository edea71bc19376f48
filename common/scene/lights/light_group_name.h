#pragma once
// Names of light groups (common/job/light_groups.h), which scene files give to lights, surfaces that emit,
// and media.
#include <string>
#include <string_view>

namespace lightmill {

struct LightGroupName {
  std::string name;    // empty: no group
  std::string change;  // one line that says how it differs from what was given; empty: it does not
};
/// `given` (UTF-8) made fit for names of channels: letters, digits, "_" and "-" stay, every other character
/// becomes "_", what is longer than kMaxLightGroupName is cut, and none ends as channels of differences do.
/// "" and "rest" stand for no group.
LightGroupName light_group_name(std::string_view given);

}  // namespace lightmill
