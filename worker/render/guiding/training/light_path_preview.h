#pragma once
// A preview pass of light paths: what they bring to the image, by how they set out.
#include <array>
#include <vector>

#include "worker/render/guiding/training/emission_groups.h"
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Cells along a side of the square of directions (guiding/emission_guide.h).
inline constexpr int32_t kEmissionSide = 32;
inline constexpr size_t kEmissionCells = size_t{kEmissionSide} * kEmissionSide;
using EmissionCells = std::array<double, kEmissionCells>;  // row-major over [-1, 1]^2

/// Sums of squares of what the light paths of a group bring, weighed as in relMSE.
struct EmissionGroupSums {
  // By half of the samples. `cells`: where the direction can be guided; times the density that it had on its
  // square, over that of an even draw.
  std::array<double, 2> all{}, without_direction{};
  std::array<EmissionCells, 2> cells{};
};

struct LightPathSums {
  std::vector<EmissionGroupSums> groups;
  double rest = 0;  // variance of all that came without light paths, weighed and summed the same way
};

/// `context`: of all strategies that are compared, with one light path per camera path. The result is the
/// same for any number of `threads`.
LightPathSums preview_light_paths(const StageContext& context, const EmissionGroups& groups, int threads);

}  // namespace lightmill
