#pragma once
// Light groups: the lights of a scene by name, as compositors want them. The AOV `lightgroups` records the
// light of each group, by whatever way it comes, in a layer of its own: "lightgroup_key". They add up to the
// image. Lights without a group are in the group "rest", which is the last one.
#include <string>
#include <vector>

namespace lightmill {

inline constexpr const char* kRestGroup = "rest";
inline constexpr size_t kMaxLightGroups = 32;  // the rest included
inline constexpr size_t kMaxLightGroupName = 64;
/// No name ends so: channels of "key_difference" are the difference of "key".
inline constexpr const char* kDifferenceSuffix = "_difference";

/// The names of a scene's groups, in the order of their layers: kRestGroup, if there is one, comes last.
/// Empty for a scene without groups.
using LightGroups = std::vector<std::string>;

/// "key,fill,rest".
std::string light_groups_text(const LightGroups& groups);
/// Inverse. Throws Error(kUsage) unless check_light_groups accepts the names.
LightGroups light_groups_of_text(const std::string& text);
/// Whether these may be a scene's: at most kMaxLightGroups, none twice, each of 1 to kMaxLightGroupName
/// letters, digits, '_' and '-' that do not end in kDifferenceSuffix, the rest last. Of untrusted bytes.
bool valid_light_groups(const LightGroups& groups);

}  // namespace lightmill
