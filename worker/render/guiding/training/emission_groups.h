#pragma once
// Lights that learn together where their light paths are to go (emission_guide_training.h).
#include <cstdint>
#include <vector>

#include "worker/render/light/light_table.h"

namespace lightmill {

/// Groups at most: where lights are more, those of least power are one group, the last.
inline constexpr size_t kMostEmissionGroups = 256;

/// What the square of a light's directions is (guiding/emission_guide.h), if it can have aims.
enum class EmissionShape : uint8_t { kNone, kDisk, kSphere };

/// The triangles of a flat lamp, or a light of any other kind.
struct EmissionGroups {
  std::vector<int32_t> of;      // per light
  std::vector<double> chosen;   // probability that a light path starts from one of them, per group
  std::vector<EmissionShape> shape;  // per group

  explicit EmissionGroups(const LightTable& lights);
  size_t count() const { return chosen.size(); }
};

}  // namespace lightmill
