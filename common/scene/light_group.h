#pragma once
// Names of light groups, which scene files give to lights, surfaces that emit, and media. Channels of images
// are named by them: `lightgroup_NAME.R`.
#include <string>
#include <string_view>

namespace lightmill {

inline constexpr size_t kMaxLightGroupName = 64;  // characters
/// The layer of all light without a group; so no group is called this.
inline constexpr std::string_view kRestOfLights = "rest";

struct LightGroupName {
  std::string name;    // empty: no group
  std::string change;  // one line that says how it differs from what was given; empty: it does not
};
/// `given` (UTF-8) made fit for names of channels: letters, digits, "_" and "-" stay, every other character
/// becomes
/// "_", and what is too long is cut. "" and "rest" stand for no group.
LightGroupName light_group_name(std::string_view given);

}  // namespace lightmill
