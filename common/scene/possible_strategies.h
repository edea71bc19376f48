#pragma once
// Which families of strategies a scene allows at all.
#include "common/job/strategies.h"
#include "common/scene/description.h"

namespace lightmill {

struct PossibleStrategies {
  Strategies set = kAllStrategies;
  const char* why_no_more = "";  // for people; empty if all are possible
};

/// Camera paths alone can see fibres (TriangleMesh::tube), and no light path can be joined to a camera whose
/// rays are weighed one by one.
PossibleStrategies possible_strategies(const SceneDescription& scene);

}  // namespace lightmill
