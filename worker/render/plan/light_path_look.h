#pragma once
// A look at what light paths bring to the image, by how they set out.
#include <array>
#include <vector>

#include "worker/render/pipeline/context.h"
#include "worker/render/plan/light_groups.h"

namespace lightmill {

/// Cells a side of the square around the disk that directions of a flat lamp project to, across its normal.
inline constexpr int32_t kAimSide = 32;
inline constexpr size_t kAimCells = size_t{kAimSide} * kAimSide;
using AimCells = std::array<double, kAimCells>;  // row-major over [-1, 1]^2 of the normal's frame

/// Sums of squares of what the light paths of a group bring, weighed as in relMSE.
struct GroupSums {
  std::array<AimCells, 2> cells{};    // of flat lamps, by half of the samples and cell of the direction
  std::array<double, 2> elsewhere{};  // by half: of all other lights, and what has no direction

  double sum(size_t half) const;
};

struct LightPathSums {
  std::vector<GroupSums> groups;
  double rest = 0;  // variance of all that came without light paths, weighed and summed alike
};

/// `context` is of all strategies that are weighed against each other, with one light path per camera path.
/// On `threads` threads, of which no bit depends.
LightPathSums look_at_light_paths(const StageContext& context, const LightGroups& groups, int threads);

}  // namespace lightmill
