#pragma once
// The light groups of a scene (common/job/light_groups.h).
#include "common/job/light_groups.h"
#include "common/scene/description.h"

namespace lightmill {

/// The groups that lights, emitters and shining media name, in this order; the first kMaxLightGroups - 1 of
/// them. The rest follows if something that shines is in none of them. `left_out`, unless null: how many were
/// too many.
LightGroups light_groups_of(const SceneDescription& scene, size_t* left_out = nullptr);

}  // namespace lightmill
