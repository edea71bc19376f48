#pragma once
// Keys of JSON documents that had another name in earlier versions: both are read, and both are printed for
// people's scripts.
#include <nlohmann/json.hpp>
#include <string>

namespace lightmill {

struct KeyAlias {
  const char *older, *name;
};
inline constexpr KeyAlias kOlderKeys[] = {
    {"aimed", "guided_emission"},
    {"aims_gain", "emission_guide_gain"},
    {"effort", "sample_allocation"},
    {"effort_gain", "adaptive_gain"},
    {"lens_weight", "light_tracing_weight"},
    {"uniform_effort", "uniform_sampling"},
    {"unmet_light", "missing_light_shares"},
};

/// For what is read: members of `object` that bear an older name get the one of today. Where both are there,
/// today's counts.
inline void take_older_keys(nlohmann::json* object) {
  if (!object->is_object()) return;
  for (const KeyAlias& alias : kOlderKeys) {
    const auto older = object->find(alias.older);
    if (older == object->end()) continue;
    nlohmann::json value = std::move(*older);
    object->erase(older);
    object->emplace(alias.name, std::move(value));  // changes nothing where the name is there
  }
}

/// For what is printed: members with a name of today stand under the older one, too, at any depth.
inline void add_older_keys(nlohmann::json* document) {
  if (document->is_structured()) {
    for (nlohmann::json& child : *document) add_older_keys(&child);
  }
  if (!document->is_object()) return;
  for (const KeyAlias& alias : kOlderKeys) {
    const auto today = document->find(alias.name);
    if (today == document->end() || document->contains(alias.older)) continue;
    nlohmann::json copy = *today;
    document->emplace(alias.older, std::move(copy));
  }
}

}  // namespace lightmill
