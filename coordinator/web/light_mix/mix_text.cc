#include "coordinator/web/light_mix/mix_text.h"

#include <algorithm>
#include <string>

#include "common/base/error.h"

namespace lightmill {
namespace {

constexpr size_t kShownBytes = 100;  // of what was sent, in the answer

[[noreturn]] void refuse_mix(const std::string& why) { throw Error(ErrorKind::kUsage, "mix: " + why); }

std::string in_quotes(std::string_view text) { return '"' + std::string(text.substr(0, kShownBytes)) + '"'; }

}  // namespace

std::vector<LightFactor> light_factors_of_text(std::string_view text, const LightGroups& groups) {
  if (text.size() > kMaxMixText)
    refuse_mix("it has " + std::to_string(text.size()) + " bytes; it may have " +
               std::to_string(kMaxMixText));
  if (groups.empty())
    refuse_mix("the job has no light groups; name groups in the scene and submit it with --aov lightgroups");
  std::vector<LightFactor> factors(groups.size(), LightFactor{1, 1, 1});
  std::vector<bool> given(groups.size());
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find(',', at), text.size());
    const std::string_view part = text.substr(at, end - at);
    const size_t colon = part.find(':');
    if (colon == std::string_view::npos) refuse_mix(in_quotes(part) + " is not NAME:FACTOR or NAME:R/G/B");
    const std::string_view name = part.substr(0, colon);
    const auto group = static_cast<size_t>(std::find(groups.begin(), groups.end(), name) - groups.begin());
    if (group == groups.size())
      refuse_mix("the job has no light group " + in_quotes(name) + "; it has " + light_groups_text(groups));
    if (given[group]) refuse_mix("light group " + in_quotes(name) + " comes twice");
    const auto factor = light_factor_of_text(part.substr(colon + 1), '/');
    if (!factor) {
      refuse_mix(in_quotes(part) +
                 ": expected a number from 0 to 1e9, or three with / between for red, green and blue");
    }
    factors[group] = *factor;
    given[group] = true;
    if (end + 1 == text.size()) refuse_mix("nothing follows the last comma");
    at = end + 1;
  }
  return factors;
}

}  // namespace lightmill
