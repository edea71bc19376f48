#pragma once
// A look at what light paths bring to the image, by how they set out.
#include <array>
#include <vector>

#include "worker/render/pipeline/context.h"
#include "worker/render/guiding/training/emission_groups.h"

namespace lightmill {

/// Cells a side of the square of directions (guiding/emission_guide.h).
inline constexpr int32_t kEmissionSide = 32;
inline constexpr size_t kEmissionCells = size_t{kEmissionSide} * kEmissionSide;
using EmissionCells = std::array<double, kEmissionCells>;  // row-major over [-1, 1]^2

/// Sums of squares of what the light paths of a group bring, weighed as in relMSE.
struct GroupSums {
  // By half of the samples. `cells` of what has a direction that can be aimed: times the density that it had
  // on its square, over that of an even draw.
  std::array<double, 2> all{}, without_direction{};
  std::array<EmissionCells, 2> cells{};
};

struct LightPathSums {
  std::vector<GroupSums> groups;
  double rest = 0;  // variance of all that came without light paths, weighed and summed alike
};

/// `context` is of all strategies that are weighed against each other, with one light path per camera path.
/// On `threads` threads, of which no bit depends.
LightPathSums preview_light_paths(const StageContext& context, const EmissionGroups& groups, int threads);

}  // namespace lightmill
