#pragma once
// What a job's image lacks of its contributions, for people.
#include <cstdint>
#include <string>
#include <vector>

#include "common/film/dropped.h"

namespace lightmill {

/// A kind with a larger share is worth a warning.
inline constexpr double kDroppedWarning = 1e-3;

struct DroppedLine {
  std::string text;  // a sentence without its full stop; of a warning with what it means or how to mend it
  bool warning = false;
  bool operator==(const DroppedLine&) const = default;
};

/// A line for each kind; none for rounding that nobody could see. `refused`: RenderCounters::nonfinite. Older
/// versions have counted that alone, without the kinds.
std::vector<DroppedLine> dropped_lines(const DroppedShares& dropped, uint64_t refused);

}  // namespace lightmill
