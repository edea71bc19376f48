#pragma once
// Groups of lights that learn an emission guide together (emission_guide_training.h).
#include <cstdint>
#include <vector>

#include "worker/render/light/light_table.h"

namespace lightmill {

/// Most groups. If there are more lights, those of least power form the last group.
inline constexpr size_t kMostEmissionGroups = 256;

/// The square of a light's directions (guiding/emission_guide.h); kNone: it can't have a guide.
enum class EmissionShape : uint8_t { kNone, kDisk, kSphere };

/// A group is the triangles of a flat lamp, or one light of any other kind.
struct EmissionGroups {
  std::vector<int32_t> of;           // per light
  std::vector<double> chosen;        // per group: probability that a light path starts from it
  std::vector<EmissionShape> shape;  // per group

  explicit EmissionGroups(const LightTable& lights);
  size_t count() const { return chosen.size(); }
};

}  // namespace lightmill
