#include "common/job/light_groups.h"

#include <algorithm>

#include "common/base/error.h"

namespace lightmill {
namespace {

bool valid_name(const std::string& name) {
  return !name.empty() && name.size() <= kMaxLightGroupName && !name.ends_with(kDifferenceSuffix) &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
                  c == '-';
         });
}

}  // namespace

std::string light_groups_text(const LightGroups& groups) {
  std::string text;
  for (const std::string& name : groups) {
    if (!text.empty()) text += ',';
    text += name;
  }
  return text;
}

LightGroups light_groups_of_text(const std::string& text) {
  LightGroups groups;
  for (size_t begin = 0; begin < text.size() && groups.size() <= kMaxLightGroups;) {
    const size_t end = std::min(text.find(',', begin), text.size());
    groups.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  if (!valid_light_groups(groups))
    throw Error(ErrorKind::kUsage, "no names of light groups: \"" + text + "\"");
  return groups;
}

bool valid_light_groups(const LightGroups& groups) {
  if (groups.size() > kMaxLightGroups || !std::all_of(groups.begin(), groups.end(), valid_name)) return false;
  LightGroups sorted = groups;
  std::sort(sorted.begin(), sorted.end());
  if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) return false;
  const auto rest = std::find(groups.begin(), groups.end(), kRestGroup);
  return rest == groups.end() || rest + 1 == groups.end();
}

}  // namespace lightmill
