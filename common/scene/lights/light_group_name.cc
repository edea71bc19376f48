#include "common/scene/lights/light_group_name.h"

#include "common/job/light_groups.h"
#include "common/scene/problem_list.h"

namespace lightmill {
namespace {

bool may_stay(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
}

/// Of a character of several bytes in UTF-8, not the first.
bool continues_character(char c) { return (static_cast<unsigned char>(c) & 0xc0) == 0x80; }

}  // namespace

LightGroupName light_group_name(std::string_view given) {
  LightGroupName out;
  for (const char c : given) {
    if (may_stay(c)) {
      out.name += c;
    } else if (!continues_character(c)) {
      out.name += '_';
    }
  }
  if (out.name.size() > kMaxLightGroupName) out.name.resize(kMaxLightGroupName);
  if (out.name.ends_with(kDifferenceSuffix)) out.name.back() = '_';
  if (out.name == kRestGroup) out.name.clear();
  if (out.name.empty() || out.name == given) return out;
  // "the group" and "the name": names after these do not make warnings of different kinds (problem_list.h).
  out.change = "the group " + in_quotes(given) + " gets the name " + in_quotes(out.name) +
               ": names of light groups hold letters, digits, \"_\" and \"-\", 64 characters at most, and do "
               "not end in \"_difference\"";
  return out;
}

}  // namespace lightmill
